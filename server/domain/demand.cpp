// How many workers the farm could use, for whoever starts and stops them.
#include <cmath>

#include "server/domain/coordinator_state.h"
#include "server/domain/job_rules.h"

namespace lightmill {
namespace {

/// A worker is wanted only if it has so much to do: it must start, and fetch scene and assets, before it helps.
constexpr double kWorthwhileSeconds = 60;

/// Threads that the job keeps busy, each for kWorthwhileSeconds or for what is left of the job's seconds; nothing if
/// nobody knows yet what its samples cost.
std::optional<double> threads_for(const Job& job, Time now) {
  const double cost = job.seconds_per_pixel_sample.value();
  if (job.undecided() || cost <= 0) {
    return std::nullopt;
  }
  const Goal& goal = job.record.spec.goal;
  double left = expected_pixel_samples(job, job.error.update(job.film));
  if (std::isinf(left) && goal.error == 0) {  // time alone ends it: what one more thread does is never too much
    return job.film.grid().tile_count();
  }
  if (std::isinf(left)) {  // its error cannot be read yet
    left = static_cast<double>(job.film.pixel_samples_at(job.samples_wanted_now()) - job.film.pixel_samples());
  }
  const double until = goal.seconds > 0 ? std::max(goal.seconds - job.active_seconds(now), 1.0) : kWorthwhileSeconds;
  return left * cost / std::min(kWorthwhileSeconds, until);
}

}  // namespace

std::uint32_t Coordinator::State::wanted_workers(Time now) const {
  std::uint32_t there = 0, busy = 0;
  std::uint64_t threads_there = 0;
  for (const auto& [name, worker] : workers) {
    if (counts(worker)) {
      ++there;
      threads_there += worker.hello.threads;
      busy += worker.leases.empty() ? 0 : 1;
    }
  }
  bool waiting = false;
  double threads = 0;
  for (const auto& [id, job] : jobs) {
    if (!held.empty() || (job->record.state != JobState::queued && job->record.state != JobState::running)) {
      continue;
    }
    waiting = true;
    // Where those who are there cannot render it, more of their kind are no help: one that is asked for may be another.
    if (!job->leases.empty() || somebody_may_render(*job)) {
      threads += threads_for(*job, now).value_or(static_cast<double>(threads_there));
    }
  }
  double wanted = waiting ? 1 : 0;
  if (there > 0) {
    wanted = std::max(wanted, std::ceil(threads * there / static_cast<double>(threads_there)));
  }
  // Nobody is sent away from work: the last of it is spread over all who are there.
  return std::max(busy, static_cast<std::uint32_t>(std::min<double>(wanted, limits.max_workers)));
}

std::uint32_t Coordinator::wanted_workers(Time now) const {
  return state_->wanted_workers(now);
}

}  // namespace lightmill
