// How what is late near the end of a job is leased to idle workers too.
#include <limits>

#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

constexpr Duration kCopyLookInterval = std::chrono::milliseconds(100);
/// On large farms only those leases that take longest are looked at, for so many workers at a time, and less often:
/// once more every kCopyLookInterval for so many leases.
constexpr std::size_t kMostLate = 64, kPairsALook = 20000, kLeasesALook = 2000;
/// Who renders something too must need this many times less, and what it takes until its first results are there.
constexpr double kCopyGain = 1.2, kCopySeconds = 0.1;
constexpr double kLeastTileSeconds = 1e-6;  ///< also of what nobody has rendered yet

}  // namespace

double Coordinator::State::tile_seconds(const Worker& worker, const Lease& lease) const {
  const Job& job = *jobs.at(lease.unit.job);
  const auto known = worker.jobs.find(job.id());
  const bool measured = known != worker.jobs.end() && known->second.seconds_per_pixel_sample.known();
  const double speed = measured ? known->second.seconds_per_pixel_sample.value() : job.seconds_per_pixel_sample.value();
  return speed * static_cast<double>(lease.unit.range.count() * job.pixels_of(lease.unit.tiles.front()));
}

double Coordinator::State::seconds_left(const Lease& lease, Time now) const {
  const Worker& worker = workers.at(lease.worker);
  if (lease.abandoned || lease.unit.tiles.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  double seconds = 0, slowdown = 0;
  for (const LeaseId id : worker.leases) {
    const Lease& each = leases.at(id);
    if (each.unit.tiles.empty() || !each.sent) {
      continue;
    }
    const double expected = std::max(tile_seconds(worker, each), kLeastTileSeconds);
    if (slowdown == 0) {
      // It works on its oldest lease: what has not come yet takes at least so long.
      const double silent = to_seconds(now - std::max(worker.result_at, each.granted));
      slowdown = std::max(1.0, silent / expected);
    }
    seconds += each.remaining * expected * slowdown / worker.hello.threads;
    if (id == lease.id) {
      break;
    }
  }
  return seconds;
}

void Coordinator::State::note_silence(Worker& worker, const Lease& lease, Time now) const {
  if (lease.id != *worker.leases.begin() || lease.abandoned || !lease.sent) {
    return;  // it works on its oldest lease, once it has that
  }
  const double silent = to_seconds(now - std::max(worker.result_at, lease.granted));
  const auto waited_for = std::ranges::find(lease.done, false) - lease.done.begin();
  const TileId tile = lease.unit.tiles[static_cast<std::size_t>(waited_for) % lease.unit.tiles.size()];
  const double pixel_samples = static_cast<double>(lease.unit.range.count() * jobs.at(lease.unit.job)->pixels_of(tile));
  worker.jobs[lease.unit.job].seconds_per_pixel_sample.expect(silent / pixel_samples);
}

void Coordinator::State::copy_to_idle(Time now, Step& step) {
  // All leases that may be copied, those that take longest first, as in Zaharia et al., Improving MapReduce Performance
  // in Heterogeneous Environments (2008). Each tile gets one copy at most, and so does a pilot; what
  // is verified is taken over, perhaps again: whoever has it is the only one.
  std::vector<std::pair<double, LeaseId>> late;
  for (const auto& [id, lease] : leases) {
    const Job& job = *jobs.at(lease.unit.job);
    const bool copied = lease.unit.tiles.empty() ? job.leases.size() > 1 : lease.copy && !lease.verifies;
    const bool old = lease.abandoned ||
                     now > lease.granted + (lease.unit.tiles.empty() ? limits.copy_pilot_after : limits.copy_after);
    if (job.record.state == JobState::running && !copied && !lease.alone && (lease.sent || lease.abandoned) && old) {
      late.emplace_back(-seconds_left(lease, now), id);
    }
  }
  std::sort(late.begin(), late.end());
  late.resize(std::min(late.size(), kMostLate));
  next_copy_look = now + kCopyLookInterval * static_cast<int>(1 + leases.size() / kLeasesALook);
  std::vector<std::string> waiting(idle.begin(), idle.end());
  std::ranges::rotate(waiting, std::ranges::upper_bound(waiting, last_copied_to));
  waiting.resize(std::min(waiting.size(), kPairsALook / std::max<std::size_t>(late.size(), 1)));
  for (const std::string& name : waiting) {
    last_copied_to = name;
    Worker* const worker = find_worker(name);
    if (worker == nullptr || !wants_more(*worker) || !worker->leases.empty()) {
      continue;
    }
    for (auto at = late.begin(); at != late.end();) {
      const Lease& lease = leases.at(at->second);
      const Job& job = *jobs.at(lease.unit.job);
      const bool sooner =
          lease.unit.tiles.empty() || -at->first > kCopyGain * tile_seconds(*worker, lease) + kCopySeconds;
      if (lease.worker == name || now < job.hold_until || !sooner ||
          !(job.undecided() ? may_pilot(*worker, job, now) : may_render(*worker, job))) {
        ++at;  // the next worker may
        continue;
      }
      const bool verifies = lease.verifies;
      if (verifies ? take_over_verification(lease, *worker, now, step) : copy_lease(lease, *worker, now, step)) {
        if (!leases.contains(at->second)) {
          late.erase(at);
        }
        break;  // the next worker may copy the rest of this lease
      }
      at = verifies ? at + 1 : late.erase(at);  // the next worker may verify what this one has rendered itself
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
                                                 job.pixels_of(lease.unit.tiles.front()), aim_for(worker, job, now));
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
  Lease& copy = open_lease(worker, job, copy_id, std::move(unit), true, now);
  send_grant(worker, job, copy, step);
  put_progress(job, now, step);
  return true;
}

bool Coordinator::State::take_over_verification(const Lease& lease, Worker& worker, Time now, Step& step) {
  Job& job = *jobs.at(lease.unit.job);
  const LeaseId from = lease.id, id = next_lease_id();
  const Renderer by = renderer_of(worker.hello, job);
  Unit unit{job.id(), lease.unit.range, {}};
  for (std::size_t i = 0; i < lease.unit.tiles.size() && unit.tiles.size() < worker.hello.threads; ++i) {
    const TileId tile = lease.unit.tiles[i];
    if (!lease.done[i] && job.verifications.take_over({unit.range, tile}, from, id, by)) {
      unit.tiles.push_back(tile);
    }
  }
  if (unit.tiles.empty()) {
    return false;
  }
  for (const TileId tile : unit.tiles) {
    tile_done(from, tile, now, step, false);  // ends the lease with its last tile
  }
  job.record.counters.copies_leased += unit.tiles.size();
  Lease& copy = open_lease(worker, job, id, std::move(unit), true, now);
  copy.verifies = true;
  send_grant(worker, job, copy, step);
  put_progress(job, now, step);
  return true;
}

}  // namespace lightmill
