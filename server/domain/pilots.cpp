#include "server/domain/pilots.h"

#include <fmt/ranges.h>

#include <cmath>
#include <limits>

#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

/// As for a result: see result_intake.cpp.
constexpr double kMaxPilotSeconds = 1e7;
constexpr std::size_t kMaxPilotReasonBytes = 1024;

/// An allocation divides the samples of the frame. The undivided rest is too small for the next step of any tile
/// (allocate() in common/film/allocation.h).
Status check_allocation(const TileGrid& grid, const Allocation& allocation) {
  double left = 0, all = 0, least_step = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < grid.picture_tiles(); ++i) {
    const auto pixels = static_cast<double>(grid.tile_rect(TileId{i}).pixel_count());
    const double share = std::ldexp(pixels, allocation.shift(TileId{i}));
    all += pixels;
    left += pixels - share;
    if (allocation.shift(TileId{i}) <= 0) {
      least_step = std::min(least_step, share);
    }
  }
  if (left >= least_step) {
    return invalid_argument("a pilot's allocation gives only {:.3g} of the frame's samples", (all - left) / all);
  }
  return ok_status();
}

Status check_pilot(const Job& job, const PilotReport& report) {
  const std::vector<std::string>& methods = job.record().method_notes.candidates;
  if (report.choice >= methods.size()) {
    return invalid_argument("pilot.choice: must be below {}, got {}", methods.size(), report.choice);
  }
  if (!(report.seconds >= 0 && report.seconds <= kMaxPilotSeconds)) {
    return invalid_argument("pilot.seconds: must be from 0 to {:.0f}, got {}", kMaxPilotSeconds, report.seconds);
  }
  if (report.reasons.size() > methods.size() + 1) {
    return invalid_argument("pilot.reasons: at most {} are possible, got {}", methods.size() + 1,
                            report.reasons.size());
  }
  const std::size_t shifts = report.allocation.shifts().size(),
                    tiles = job.spec().goal.adaptive ? job.film().grid().tile_count() : 0;
  if (shifts != 0 && shifts != tiles) {
    return invalid_argument("a pilot's allocation has {} tiles instead of {}", shifts, tiles);
  }
  if (shifts != 0) {
    LM_RETURN_IF_ERROR(check_allocation(job.film().grid(), report.allocation));
  }
  for (const std::string& reason : report.reasons) {
    if (reason.size() > kMaxPilotReasonBytes) {
      return invalid_argument("a pilot's reason has {} bytes, more than {}", reason.size(), kMaxPilotReasonBytes);
    }
  }
  return ok_status();
}

}  // namespace

bool Pilots::may_have(const Worker& worker, const Job& job, Time now) {
  return !worker.has_pilot() && now >= worker.pilots_from() && lightmill::may_have(worker, job, now);
}

void Pilots::grant(Worker& worker, Job& job, const Event& event) {
  if (job.record().fingerprint_class.empty()) {
    life_cycle_.start(job, worker, event);
  }
  const std::vector<std::string>& methods = job.record().method_notes.candidates;
  const LeaseId id = leases_.next_id();
  leases_.open(worker, job, {.id = id, .unit = {job.id(), {}, {}}, .alone = job.losses().pilot_is_suspect()},
               event.now);
  leases_.wait_for_commit(worker, job, id);
  event.send_after_commit(*worker.session(),
                          PilotGrant{id, job.id(), job.spec().settings, methods, job.spec().goal.adaptive});
  event.info(about(job.id(), worker.name()), "worker {} {} {} for job {}", worker.name(),
             methods.size() > 1 ? "compares" : "measures the noise of", fmt::join(methods, " and "), job.id().value);
  queue_.refresh(job);
}

Result<bool> Pilots::report(Worker& worker, const PilotReport& report, const Event& event) {
  const Lease* const lease = leases_.find(report.lease);
  if (lease == nullptr || lease->worker != worker.name() || !lease->is_pilot()) {
    return false;
  }
  Job& job = jobs_.at(lease->unit.job);
  if (const Status status = check_pilot(job, report); !status.ok()) {
    event.warn(about(job.id(), worker.name()), "worker {}: the pilot of job {} is dropped: {}", worker.name(),
               job.id().value, message_of(status));
    return status;
  }
  worker.pilot_received();
  const double seconds = lease->possible_seconds(report.seconds, event.now);
  leases_.end(report.lease, {}, event);
  while (!job.leases().empty()) {  // its copy, or the original lease
    const LeaseId other = *job.leases().begin();
    leases_.end(other, {.cancel = true, .lost = leases_.at(other).abandoned}, event);
  }
  job.choose_method(report, seconds, worker.identity());
  job.store(event);
  event.info(about(job.id()), "job {} is rendered by {}: {}", job.id().value, job.spec().settings.method,
             fmt::join(job.record().method_notes.reasons, "; "));
  queue_.refresh(job);
  return true;
}

}  // namespace lightmill
