// Sizes of units: about a second of the worker's time, but not more results than the coordinator can take.
#include <map>

#include "common/methods/spec/method_spec.h"
#include "server/domain/scheduler.h"

namespace lightmill {
namespace {

/// While the sample cost of a job is unknown, units have one sample per pixel. The coordinator leases so many that it
/// can take their results within this time. Else thousands of workers would send theirs at once.
constexpr double kTriedSeconds = 0.5;
/// What a worker may hold of a job: this times what it delivered of it in the last minute. Where units take longer than
/// a quarter of a minute, so many units.
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
    // When its time is up, the job waits for leased units. The lower limit keeps the rate of results within the pace.
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
  std::map<std::string_view, std::vector<Duration>> by_identity;  // a liar may have many workers, but one voice
  for (const auto& [name, worker] : workers_.all()) {
    if (const auto wait = worker.wait_since(result_rate_.heard_from(event.now)); wait && worker.counts()) {
      by_identity[worker.identity()].push_back(*wait);
    }
  }
  std::vector<Duration> waits;
  for (auto& [identity, of_workers] : by_identity) {
    waits.push_back(middle_of(of_workers));
  }
  if (!result_rate_.update(waits, event.now)) {
    return;
  }
  const double most = limits_.result_bytes_per_second;
  if (!slowed_ && result_rate_.bytes_per_second() < most / 2) {
    slowed_ = true;
    event.warn({},
               "workers' results wait long for the coordinator: workers send fewer results, each with more samples");
  } else if (slowed_ && result_rate_.bytes_per_second() == most) {
    slowed_ = false;
    event.info({}, "workers' results no longer wait: workers send them as often as before");
  }
}

}  // namespace lightmill
