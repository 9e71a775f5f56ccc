#include "tests/simulation/time_checks.h"

#include <algorithm>

#include "tests/simulation/client_side.h"
#include "tests/simulation/server_side.h"

namespace lightmill::simulation {

void TimeChecks::check(const Effects& effects) {
  for (const std::vector<Outgoing>* channel : {&effects.now, &effects.after_commit}) {
    for (const Outgoing& message : *channel) {
      if (const auto* const grant = std::get_if<LeaseGrant>(&message.message)) {
        check_granted(grant->unit);
      }
    }
  }
  for (const StoreOp& op : effects.writes) {
    if (const auto* const put = std::get_if<PutJob>(&op);
        put != nullptr && put->record.state == JobState::done && put->record.reached == GoalLimit::seconds &&
        std::exchange(finished_[put->record.id], put->record.finished_unix_ms) != put->record.finished_unix_ms) {
      check_done(put->record);
    }
  }
}

double TimeChecks::seconds_of(const JobSpec& spec) const {
  return spec.goal.seconds > 0 ? clients_.job_of(spec.settings).spec.goal.seconds : 0;
}

void TimeChecks::check_granted(const Unit& unit) {
  const Result<JobStatus> status = server_.coordinator()->status(unit.job, world_.now);
  if (!status.ok()) {
    return;
  }
  granted_first_.try_emplace(unit.job, world_.now);
  const double seconds = seconds_of(**server_.coordinator()->spec(unit.job));
  const bool time_is_up = seconds > 0 && status->active_seconds >= seconds;
  for (const TileId tile : unit.tiles) {
    std::uint64_t& end = granted_to_[{unit.job, tile}];
    if (time_is_up && unit.range.end() > std::max<std::uint64_t>(end, 1)) {
      world_.fail(fmt::format("samples [{}, {}) of tile {} of job {} are granted after {:.3f} of {:.3f} seconds",
                              unit.range.first(), unit.range.end(), tile.value, unit.job.value, status->active_seconds,
                              seconds));
    }
    end = std::max(end, unit.range.end());
  }
}

void TimeChecks::check_done(const JobRecord& job) const {
  const double seconds = seconds_of(job.spec);
  const auto first = granted_first_.find(job.id);
  const double passed = first == granted_first_.end() ? 0 : to_seconds(world_.now - first->second);
  if (std::min(passed, job.active_seconds) < seconds) {
    world_.fail(
        fmt::format("job {} ends by time {:.6f} s after its first grant, rendered for {:.6f} s, and should be "
                    "for {:.6f} s",
                    job.id.value, passed, job.active_seconds, seconds));
  }
}

}  // namespace lightmill::simulation
