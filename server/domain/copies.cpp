#include "server/domain/copies.h"

#include <limits>

#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

constexpr Duration kCheckInterval = std::chrono::milliseconds(100);
/// Limits of a search on large farms: the latest leases, and pairs of lease and worker. For each kLeasesPerCheck
/// leases the next search comes one interval later.
constexpr std::size_t kMaxLate = 64, kPairsPerCheck = 20000, kLeasesPerCheck = 2000;
/// The expected time of the copy, times kCopyGain, plus kCopySeconds for sending, must be less than the remaining time.
constexpr double kCopyGain = 1.2, kCopySeconds = 0.1;
constexpr double kMinTileSeconds = 1e-6;  ///< also for a job without results

}  // namespace

double Copies::tile_seconds(const Worker& worker, const Lease& lease) const {
  const Job& job = jobs_.at(lease.unit.job);
  const WorkerJob* const known = worker.find_job(job.id());
  const MeasuredCost& cost = known != nullptr && known->cost.known() ? known->cost : job.cost();
  return cost.mean.value() * static_cast<double>(lease.unit.range.count() * job.pixels_of(lease.unit.tiles.front()));
}

double Copies::seconds_left(const Lease& lease, Time now) const {
  const Worker& worker = workers_.at(lease.worker);
  if (lease.abandoned || lease.is_pilot()) {
    return std::numeric_limits<double>::infinity();
  }
  double seconds = 0, slowdown = 0, least = 0;
  for (const LeaseId id : worker.leases()) {
    const Lease& each = leases_.at(id);
    if (each.is_pilot() || !each.sent) {
      continue;
    }
    const double expected = std::max(tile_seconds(worker, each), kMinTileSeconds);
    if (slowdown == 0) {
      // The worker renders its oldest lease. The tile in work takes at least as long as the worker is silent.
      const double silent = to_seconds(now - std::max(worker.result_at(), each.granted));
      slowdown = std::max(1.0, silent / expected);
      least = to_seconds(now - each.last_progress);  // results of other leases do not count
    }
    least = std::max(least, expected * slowdown);  // of one tile, however many threads the worker claims
    seconds += each.remaining * expected * slowdown / worker.threads();
    if (id == lease.id) {
      break;
    }
  }
  return std::max(seconds, least);
}

bool Copies::may_be_copied(const Lease& lease, Time now) const {
  // A copy is not copied again. An audit moves to another worker, perhaps more than once.
  const Job& job = jobs_.at(lease.unit.job);
  const bool copied = lease.copy && !lease.audits;
  const Duration delay = lease.is_pilot() ? limits_.copy_pilot_after : limits_.copy_after;
  return job.state() == JobState::running && !copied && (lease.sent || lease.abandoned) &&
         (lease.abandoned || now > lease.granted + delay);
}

std::vector<Copies::Late> Copies::late_leases(Time now) const {
  std::vector<Late> late;
  for (const auto& [id, lease] : leases_.all()) {
    if (may_be_copied(lease, now)) {
      late.push_back({seconds_left(lease, now), id});
    }
  }
  std::ranges::sort(late, {}, [](const Late& each) { return std::pair(-each.seconds, each.lease); });
  late.resize(std::min(late.size(), kMaxLate));
  return late;
}

std::optional<Time> Copies::next_deadline() const {
  const bool possible = scheduler_.held().empty() && !workers_.idle().empty() && !leases_.all().empty();
  return possible ? std::optional(next_check_) : std::nullopt;
}

void Copies::tick(const Event& event) {
  if (const std::optional<Time> due = next_deadline(); !due || event.now < *due) {
    return;
  }
  std::vector<Late> late = late_leases(event.now);
  next_check_ = event.now + kCheckInterval * static_cast<int>(1 + leases_.all().size() / kLeasesPerCheck);
  std::vector<std::string> waiting(workers_.idle().begin(), workers_.idle().end());
  std::rotate(waiting.begin(), std::ranges::upper_bound(waiting, last_worker_), waiting.end());
  waiting.resize(std::min(waiting.size(), kPairsPerCheck / std::max<std::size_t>(late.size(), 1)));
  for (const std::string& name : waiting) {
    last_worker_ = name;
    Worker* const worker = workers_.find(name);
    if (worker != nullptr && leases_.wants_more(*worker) && worker->leases().empty()) {
      copy_one(*worker, late, event);
    }
  }
}

template <class Leases>
bool Copies::may_also_hold(const Worker& worker, const Leases& holders) const {
  std::set<std::string_view> identities;
  for (const LeaseId id : holders) {
    identities.insert(workers_.at(leases_.at(id).worker).identity());
  }
  return holders.size() == 1 ||
         (holders.size() == 2 && identities.size() == 1 && !identities.contains(worker.identity()));
}

void Copies::copy_one(Worker& worker, std::vector<Late>& late, const Event& event) {
  for (auto at = late.begin(); at != late.end();) {
    const Lease& lease = leases_.at(at->lease);
    const Job& job = jobs_.at(lease.unit.job);
    const bool sooner = lease.is_pilot() || at->seconds > kCopyGain * tile_seconds(worker, lease) + kCopySeconds;
    const bool same_identity = workers_.at(lease.worker).identity() == worker.identity();
    if (lease.worker == worker.name() || !sooner || (same_identity && (at->for_others || lease.alone)) ||
        !(job.undecided() ? Pilots::may_have(worker, job, event.now) : may_have(worker, job, event.now))) {
      ++at;  // another idle worker may copy it
      continue;
    }
    const bool audits = lease.audits;
    if (audits ? take_over_audit(lease, worker, event) : copy(lease, worker, event)) {
      if (leases_.find(at->lease) == nullptr) {
        late.erase(at);
      }
      return;  // the next worker may copy the rest of this lease
    }
    // The next worker may audit results that this one rendered. Workers of another identity may copy tiles that this
    // one may not.
    at->for_others = !audits;
    at = audits || same_identity ? at + 1 : late.erase(at);
  }
}

bool Copies::copy(const Lease& lease, Worker& worker, const Event& event) {
  Job& job = jobs_.at(lease.unit.job);
  if (lease.is_pilot()) {
    const bool may_copy = may_also_hold(worker, job.leases());
    if (may_copy) {
      pilots_.grant(worker, job, event);
    }
    return may_copy;
  }
  const std::uint32_t wanted =
      choose_tile_count(lease.unit.range, lease.remaining, job.pixels_of(lease.unit.tiles.front()),
                        scheduler_.aim_for(worker, job, event.now));
  // From the end of the lease, because its worker renders from the front.
  const LeaseId id = leases_.next_id();
  Unit unit{job.id(), lease.unit.range, {}};
  for (std::size_t i = lease.unit.tiles.size(); i-- > 0 && unit.tiles.size() < std::max(wanted, worker.threads());) {
    const TileId tile = lease.unit.tiles[i];
    if (!lease.done[i] && may_also_hold(worker, job.plan().holders(tile, lease.unit.range)) &&
        job.plan().add_copy(id, tile, lease.unit.range)) {
      unit.tiles.push_back(tile);
    }
  }
  if (unit.tiles.empty()) {
    return false;
  }
  std::sort(unit.tiles.begin(), unit.tiles.end());
  open_copy(worker, job, {.id = id, .unit = std::move(unit), .copy = true, .alone = lease.alone}, event);
  return true;
}

bool Copies::take_over_audit(const Lease& lease, Worker& worker, const Event& event) {
  Job& job = jobs_.at(lease.unit.job);
  const LeaseId from = lease.id, id = leases_.next_id();
  const Renderer by = renderer_of(worker, job);
  Unit unit{job.id(), lease.unit.range, {}};
  for (std::size_t i = 0; i < lease.unit.tiles.size() && unit.tiles.size() < worker.threads(); ++i) {
    const TileId tile = lease.unit.tiles[i];
    if (!lease.done[i] && job.audits().take_over({unit.range, tile}, from, id, by)) {
      unit.tiles.push_back(tile);
    }
  }
  if (unit.tiles.empty()) {
    return false;
  }
  for (const TileId tile : unit.tiles) {
    leases_.tile_done(from, tile, false, event);  // ends the lease with its last tile
  }
  open_copy(worker, job, {.id = id, .unit = std::move(unit), .copy = true, .audits = true}, event);
  return true;
}

void Copies::open_copy(Worker& worker, Job& job, Lease lease, const Event& event) {
  const LeaseId id = lease.id;
  leases_.open(worker, job, std::move(lease), event.now);
  leases_.send_grant(worker, job, id, event);
  job.store_progress(event);
}

}  // namespace lightmill
