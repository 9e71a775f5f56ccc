// Demand: how many workers the farm could use, for autoscalers.
#include <cmath>

#include "server/domain/eligibility.h"
#include "server/domain/farm_view.h"

namespace lightmill {
namespace {

/// A worker is wanted only if it has so much to do, because it must first start and fetch scene and assets.
constexpr double kWorthwhileSeconds = 60;

/// Threads that the job keeps busy for kWorthwhileSeconds. Nothing if it uses the connected workers: its sample cost is
/// unknown, or it ends before a new worker would help.
std::optional<double> threads_for(const Job& job, Time now) {
  if (job.plan().closed() && !job.plan().has_work()) {
    return 0;  // it only waits for open leases
  }
  const double cost = job.cost().mean.value();
  const Goal& goal = job.spec().goal;
  if (job.undecided() || cost <= 0 ||
      (goal.seconds > 0 && goal.seconds - job.active_seconds(now) < kWorthwhileSeconds)) {
    return std::nullopt;
  }
  double left = expected_pixel_samples(job, goal.error > 0 ? job.frame_error() : FrameError{});
  if (std::isinf(left) && goal.error == 0) {  // only time ends it: it can use any number of threads
    return job.film().grid().tile_count();
  }
  if (std::isinf(left)) {  // its error cannot be read yet
    left = static_cast<double>(job.film().pixel_samples_at(job.samples_wanted_now()) - job.film().pixel_samples());
  }
  return left * cost / kWorthwhileSeconds;
}

}  // namespace

bool FarmView::wants_workers() const {
  const bool waiting = std::ranges::any_of(jobs_.all(), [](const auto& entry) { return entry.second->in_progress(); });
  return (scheduler_.held().empty() && waiting) || std::ranges::any_of(workers_.all(), [](const auto& entry) {
           return entry.second.counts() && !entry.second.leases().empty();
         });
}

std::uint32_t FarmView::wanted_workers(Time now) const {
  std::uint32_t there = 0, busy = 0, quarantined = 0;
  KindsOfEvent kinds(workers_);
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.counts()) {
      ++there;
      busy += worker.leases().empty() ? 0 : 1;
    }
    quarantined += worker.session() && worker.quarantined() ? 1 : 0;
  }
  const auto threads_there = static_cast<double>(workers_.claimed_threads());
  bool waiting = false, all_that_are_here = false;
  double threads = 0;
  for (const auto& [id, job] : jobs_.all()) {
    if (!scheduler_.held().empty() || !job->in_progress()) {
      continue;
    }
    waiting = true;
    // If no connected worker can render it, more of their kind do not help. One new worker may be of another kind.
    if (!job->leases().empty() || any_may_render(*job, kinds.get())) {
      const std::optional<double> keeps_busy = threads_for(*job, now);
      threads += keeps_busy.value_or(0);
      all_that_are_here = all_that_are_here || !keeps_busy;
    }
  }
  if (all_that_are_here) {
    threads = std::max(threads, threads_there);
  }
  double wanted = waiting ? 1 : 0;
  if (there > 0) {
    wanted = std::max(wanted, std::ceil(threads * there / threads_there));
  }
  // No busy worker is sent away, so the last work is spread over all connected workers.
  wanted = std::max<double>(wanted, busy);
  // A worker in quarantine takes a place and does nothing.
  wanted += wanted > 0 ? quarantined : 0;
  return static_cast<std::uint32_t>(std::min<double>(wanted, std::max(limits_.max_workers, busy)));
}

}  // namespace lightmill
