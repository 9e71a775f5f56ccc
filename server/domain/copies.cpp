// How what is late near the end of a job is leased to idle workers too.
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// A lease is copied when it is out for longer than this many times what was expected (its worker may have had one
/// before it).
constexpr double kCopyAfterExpected = 2;
constexpr Duration kCopyLookInterval = std::chrono::milliseconds(100);

}  // namespace

void Coordinator::State::copy_to_idle(Time now, Step& step) {
  next_copy_look = now + kCopyLookInterval;
  // Leases that are late, the oldest first. Each tile gets one copy at most, and so does a pilot.
  std::vector<std::pair<Time, LeaseId>> late;
  for (const auto& [id, lease] : leases) {
    const Job& job = *jobs.at(lease.unit.job);
    const double age = to_seconds(now - lease.granted);
    const double patience =
        lease.abandoned ? 0 : to_seconds(limits.copy_after) + kCopyAfterExpected * lease.expected_seconds;
    const bool copied = lease.unit.tiles.empty() ? job.leases.size() > 1 : lease.copy;
    if (job.record.state == JobState::running && !copied && !lease.alone && !lease.verifies && age > patience) {
      late.emplace_back(lease.granted, id);
    }
  }
  std::sort(late.begin(), late.end());
  const std::vector<std::string> waiting(idle.begin(), idle.end());
  for (const std::string& name : waiting) {
    Worker* const worker = find_worker(name);
    if (worker == nullptr || !wants_more(*worker) || !worker->leases.empty()) {
      continue;
    }
    for (auto at = late.begin(); at != late.end();) {
      const Lease& lease = leases.at(at->second);
      const Job& job = *jobs.at(lease.unit.job);
      if (lease.worker == name || now < job.hold_until ||
          !(job.undecided() ? may_pilot(*worker, job, now) : may_render(*worker, job))) {
        ++at;  // the next worker may
        continue;
      }
      if (copy_lease(lease, *worker, now, step)) {
        break;  // the next worker may copy the rest of this lease
      }
      at = late.erase(at);
    }
  }
}

bool Coordinator::State::copy_lease(const Lease& lease, Worker& worker, Time now, Step& step) {
  Job& job = *jobs.at(lease.unit.job);
  if (lease.unit.tiles.empty()) {
    const bool alone = job.leases.size() == 1;
    if (alone) {
      grant_pilot(worker, job, now, step);
    }
    return alone;
  }
  const std::uint32_t wanted = choose_tile_count(lease.unit.range, lease.remaining,
                                                 job.pixels_of(lease.unit.tiles.front()), aim_for(worker, job));
  // From its end: its worker works from the front.
  const LeaseId copy_id = next_lease_id();
  Unit unit{job.id(), lease.unit.range, {}};
  for (std::size_t i = lease.unit.tiles.size();
       i-- > 0 && unit.tiles.size() < std::max(wanted, worker.hello.threads);) {
    if (!lease.done[i] && job.plan->add_copy(copy_id, lease.unit.tiles[i], lease.unit.range)) {
      unit.tiles.push_back(lease.unit.tiles[i]);
    }
  }
  if (unit.tiles.empty()) {
    return false;
  }
  std::sort(unit.tiles.begin(), unit.tiles.end());
  job.record.counters.copies_leased += unit.tiles.size();
  const Lease& copy = open_lease(worker, job, copy_id, std::move(unit), true, now);
  send_grant(worker, job, copy, step);
  put_progress(job, now, step);
  return true;
}

}  // namespace lightmill
