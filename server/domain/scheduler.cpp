#include "server/domain/scheduler.h"

#include <map>
#include <set>

#include "common/methods/spec/method_spec.h"
#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

/// While the sample cost of a job is unknown, units have one sample per pixel. The coordinator leases only as many
/// units as it can receive results for within this time. Otherwise thousands of workers would send theirs at once.
constexpr double kTriedSeconds = 0.5;
/// Limit of the pixel samples of a job that a worker may hold: kRecentWork times those that it delivered in the last
/// minute. If its units take longer than half a minute, the limit is kUnitsHeld units.
constexpr double kRecentWork = 2, kUnitsHeld = 4;

double pixels_of_a_tile(const Job& job) {
  return static_cast<double>(
      std::min<std::uint64_t>(job.film().grid().pixel_count(), std::uint64_t{kTileSize} * kTileSize));
}

/// Most bytes of a result of a whole tile.
double node_bytes(const Job& job) {
  return static_cast<double>(job.film().layout().most_values() * sizeof(float)) * pixels_of_a_tile(job);
}

}  // namespace

void Scheduler::serve(Worker& worker, const Event& event) {
  while (serve_once(worker, event)) {
  }
}

void Scheduler::serve_all(const Event& event) {
  if (queue_.empty()) {
    return;
  }
  std::vector<std::pair<LeaseId, std::string>> waiting;
  for (const std::string& name : workers_.idle()) {
    waiting.emplace_back(workers_.at(name).waits_since(), name);
  }
  std::ranges::sort(waiting);
  while (!waiting.empty() && !queue_.empty()) {
    std::erase_if(waiting, [&](const auto& each) {
      Worker* const worker = workers_.find(each.second);
      return worker == nullptr || !serve_once(*worker, event);
    });
  }
}

void Scheduler::hold(const std::string& why, const Event& event) {
  if (held_ == why) {
    return;
  }
  if (why.empty()) {
    event.info({}, "leasing resumes");
  } else if (held_.empty()) {
    event.warn({}, "leasing is stopped: {}", why);
  }
  held_ = why;
  for (const auto& [id, job] : jobs_.all()) {
    if (job->active()) {
      job->touch();
    }
  }
  serve_all(event);
}

bool Scheduler::serve_once(Worker& worker, const Event& event) {
  if (!leases_.wants_more(worker)) {
    workers_.set_idle(worker, false);
    return false;
  }
  const bool granted = held_.empty() && grant_next(worker, event);
  if (!granted) {
    workers_.set_idle(worker, true);
  }
  return granted;
}

bool Scheduler::grant_next(Worker& worker, const Event& event) {
  for (auto at = queue_.begin(); at != queue_.end();) {
    Job& job = jobs_.at(at->job);
    ++at;  // the code below may move or remove the job's entry
    life_cycle_.close_if_time_is_up(job, event);
    if (!queue_.contains(job.id()) || queue_.fell_behind(job, at == queue_.end() ? nullptr : &*at) ||
        !may_have(worker, job, event.now) || !may_start(worker, job)) {
      continue;
    }
    const std::optional<bool> granted = grant(worker, job, event);
    if (!granted || *granted) {
      return granted.has_value();
    }
  }
  return false;
}

bool Scheduler::may_start(const Worker& worker, const Job& job) const {
  if (!job.record().fingerprint_class.empty() || job.spec().allow_mixed || job.spec().audit_share <= 0 ||
      workers_.identities_like(worker) > 1 || !workers_.any_can_audit(worker.hello().renderer_version)) {
    return true;
  }
  if (job.refusals().none() && job.record().counters.leases_lost == 0) {
    return false;
  }
  std::map<std::string_view, std::set<std::string_view>> identities;  // by class, of those that may render it
  for (const auto& [name, other] : workers_.all()) {
    if (other.counts() && may_render(other, job)) {
      identities[other.hello().fingerprint_class].insert(other.identity());
    }
  }
  return std::ranges::none_of(identities, [](const auto& each) { return each.second.size() > 1; });
}

std::optional<bool> Scheduler::grant(Worker& worker, Job& job, const Event& event) {
  if (job.undecided()) {
    if (!job.leases().empty() || !job.plan().has_work() || !Pilots::may_have(worker, job, event.now)) {
      return false;
    }
    if (job.losses().pilot_is_suspect() && !worker.leases().empty()) {
      return std::nullopt;
    }
    pilots_.grant(worker, job, event);
    return true;
  }
  const bool has_work = job.plan().has_work();
  // The first picture comes first, then audits: the sooner wrong results are found, the less is rendered again.
  if (!(has_work && job.plan().first_round()) && grant_audit(worker, job, event)) {
    return true;
  }
  if (!has_work || enough_is_tried(job)) {
    return false;
  }
  const bool alone = job.plan().next_is_alone();
  if (alone && !worker.leases().empty()) {
    return std::nullopt;  // until it has no other leases: other jobs must not give it more
  }
  const LeaseId id = leases_.next_id();
  const UnitAim aim = aim_for(worker, job, event.now);
  if (aim.most_pixel_samples <= 0) {
    return false;
  }
  result_rate_.add_unit(from_seconds(std::max(limits_.unit_seconds, 2 * aim.results_seconds)));
  std::optional<Unit> unit = job.plan().take(job.id(), id, aim);
  if (!unit) {
    queue_.refresh(job);
    return false;
  }
  if (job.record().fingerprint_class.empty()) {
    life_cycle_.start(job, worker, event);
  }
  leases_.open(worker, job, {.id = id, .unit = *std::move(unit), .alone = alone}, event.now);
  leases_.send_grant(worker, job, id, event);
  queue_.refresh(job);
  return true;
}

bool Scheduler::grant_audit(Worker& worker, Job& job, const Event& event) {
  const Renderer by = renderer_of(worker, job);
  std::vector<PendingAudits::Key> keys = job.audits().next_for(by, 1);
  if (keys.empty()) {
    return false;
  }
  const SampleRange range = keys.front().range;
  const std::uint32_t tiles = choose_tile_count(range, job.audits().size() - job.audits().out(),
                                                job.pixels_of(keys.front().tile), aim_for(worker, job, event.now));
  if (tiles > 1) {
    keys = job.audits().next_for(by, tiles);
  }
  const LeaseId id = leases_.next_id();
  Unit unit{job.id(), range, {}};
  for (const PendingAudits::Key& key : keys) {
    unit.tiles.push_back(key.tile);
    job.audits().lease(key, id);
  }
  leases_.open(worker, job, {.id = id, .unit = std::move(unit), .audits = true}, event.now);
  leases_.send_grant(worker, job, id, event);
  queue_.refresh(job);
  return true;
}

// ---- sizes of units ----

double Scheduler::most_pixel_samples(const Worker& worker, const Job& job, const UnitAim& aim, Time now) const {
  const WorkerJob* const known = worker.find_job(job.id());
  const double recent = known == nullptr ? 0 : known->delivered_samples.recent(now);
  const double window = to_seconds(kDeliveryBin) * 10;
  double most = std::max(limits_.tiles_at_first * pixels_of_a_tile(job),
                         recent * std::max(kRecentWork, kUnitsHeld * aim.unit_seconds / window));
  for (const LeaseId id : worker.leases()) {
    const Lease& lease = leases_.at(id);
    most -= lease.unit.job == job.id()
                ? lease.remaining * static_cast<double>(lease.unit.range.count()) * pixels_of_a_tile(job)
                : 0;
  }
  return most;
}

UnitAim Scheduler::aim_for(const Worker& worker, const Job& job, Time now) const {
  UnitAim aim;
  aim.farm_threads = static_cast<std::uint32_t>(std::max<std::uint64_t>(workers_.threads(), 1));
  set_times(limits_.unit_seconds, node_bytes(job), result_rate_.bytes_per_second(), aim);
  if (const double seconds = job.spec().goal.seconds; seconds > 0) {
    // When its time is up, the job waits for leased units. The lower limit keeps the rate of results within its limit.
    const double least = std::min(std::max(aim.unit_seconds / 2, 2 * aim.least_seconds), aim.unit_seconds);
    aim.unit_seconds = std::clamp(seconds - job.active_seconds(now), least, aim.unit_seconds);
  }
  aim.unit_seconds *= worker.unit_scale();
  const WorkerJob* const known = worker.find_job(job.id());
  aim.seconds_per_pixel_sample = (known != nullptr && known->cost.known() ? known->cost : job.cost()).peak.value();
  aim.threads = worker.threads();
  aim.most_pixel_samples = most_pixel_samples(worker, job, aim, now);
  const Result<MethodSpec> method = parse_method(job.spec().settings.method);
  aim.shared_samples = method.ok() ? shared_samples(*method) : 0;
  return aim;
}

bool Scheduler::enough_is_tried(const Job& job) const {
  if (job.cost().known()) {
    return false;
  }
  const double results = static_cast<double>(job.plan().out_pixel_samples()) / pixels_of_a_tile(job);
  return results * node_bytes(job) > kTriedSeconds * result_rate_.bytes_per_second();
}

void Scheduler::result_received(const WorkerResult& result, Time now) {
  result_rate_.add_result(static_cast<double>(result.node.values.size() * sizeof(float)) + kBytesOfAResult, now);
}

void Scheduler::update_result_rate(const Event& event) {
  if (!held_.empty()) {
    result_rate_.note_stall(event.now);
  }
  if (!result_rate_.is_due(event.now)) {
    return;
  }
  std::map<std::string_view, std::vector<Duration>>
      by_identity;  // an identity counts once, however many workers it has
  for (const auto& [name, worker] : workers_.all()) {
    if (const auto wait = worker.wait_since(result_rate_.window_start(event.now)); wait && worker.counts()) {
      by_identity[worker.identity()].push_back(*wait);
    }
  }
  std::vector<Duration> waits;
  for (auto& [identity, of_workers] : by_identity) {
    waits.push_back(median_of(of_workers));
  }
  if (!result_rate_.update(waits, event.now)) {
    return;
  }
  const double most = limits_.result_bytes_per_second;
  if (!slowed_ && result_rate_.bytes_per_second() < most / 2) {
    slowed_ = true;
    event.warn(
        {},
        "results wait long for their acknowledgement. Workers send fewer of them, each with more samples. Check the "
        "disk and the load of the coordinator, or lower --results-rate");
  } else if (slowed_ && result_rate_.bytes_per_second() == most) {
    slowed_ = false;
    event.info({}, "workers' results no longer wait: workers send them as often as before");
  }
}

}  // namespace lightmill
