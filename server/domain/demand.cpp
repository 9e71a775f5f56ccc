// How many workers the farm could use, for whoever starts and stops them.
#include <cmath>

#include "server/domain/coordinator_state.h"
#include "server/domain/job_rules.h"

namespace lightmill {
namespace {

/// A worker is wanted only if it has so much to do: it must start, and fetch scene and assets, before it helps.
constexpr double kWorthwhileSeconds = 60;

/// Threads that the job keeps busy for kWorthwhileSeconds; nothing if it takes whoever is there: nobody knows yet what
/// its samples cost, or it ends before somebody new would be worth it.
std::optional<double> threads_for(const Job& job, Time now) {
  if (job.plan->closed() && !job.plan->has_work()) {
    return 0;  // it waits for what is out
  }
  const double cost = job.seconds_per_pixel_sample.value();
  const Goal& goal = job.record.spec.goal;
  if (job.undecided() || cost <= 0 ||
      (goal.seconds > 0 && goal.seconds - job.active_seconds(now) < kWorthwhileSeconds)) {
    return std::nullopt;
  }
  double left = expected_pixel_samples(job, goal.error > 0 ? job.error.update(job.film) : FrameError{});
  if (std::isinf(left) && goal.error == 0) {  // time alone ends it: what one more thread does is never too much
    return job.film.grid().tile_count();
  }
  if (std::isinf(left)) {  // its error cannot be read yet
    left = static_cast<double>(job.film.pixel_samples_at(job.samples_wanted_now()) - job.film.pixel_samples());
  }
  return left * cost / kWorthwhileSeconds;
}

/// What of a worker decides whether its results would be a job's.
struct Kind {
  std::string fingerprint_class, renderer_version;
  bool operator==(const Kind&) const = default;
};

bool goes_on(const Job& job) {
  return job.record.state == JobState::queued || job.record.state == JobState::running;
}

}  // namespace

bool Coordinator::State::wants_workers() const {
  return (held.empty() && std::ranges::any_of(jobs, [](const auto& entry) { return goes_on(*entry.second); })) ||
         std::ranges::any_of(workers,
                             [&](const auto& entry) { return counts(entry.second) && !entry.second.leases.empty(); });
}

std::uint32_t Coordinator::State::wanted_workers(Time now) const {
  std::uint32_t there = 0, busy = 0, quarantined = 0;
  std::uint64_t threads_there = 0;
  std::vector<Kind> kinds;  // few, however many workers there are
  for (const auto& [name, worker] : workers) {
    if (counts(worker)) {
      ++there;
      threads_there += worker.hello.threads;
      busy += worker.leases.empty() ? 0 : 1;
      if (Kind kind{worker.hello.fingerprint_class, worker.hello.renderer_version}; !std::ranges::count(kinds, kind)) {
        kinds.push_back(std::move(kind));
      }
    }
    quarantined += worker.session && worker.quarantined ? 1 : 0;
  }
  bool waiting = false, whoever_is_there = false;
  double threads = 0;
  for (const auto& [id, job] : jobs) {
    if (!held.empty() || !goes_on(*job)) {
      continue;
    }
    waiting = true;
    // Where those who are there cannot render it, more of their kind are no help: one that is asked for may be another.
    const bool suited = std::ranges::any_of(
        kinds, [&](const Kind& kind) { return suits(kind.fingerprint_class, kind.renderer_version, *job); });
    if (!job->leases.empty() || (suited && somebody_may_render(*job))) {
      const std::optional<double> keeps_busy = threads_for(*job, now);
      threads += keeps_busy.value_or(0);
      whoever_is_there = whoever_is_there || !keeps_busy;
    }
  }
  if (whoever_is_there) {
    threads = std::max(threads, static_cast<double>(threads_there));
  }
  double wanted = waiting ? 1 : 0;
  if (there > 0) {
    wanted = std::max(wanted, std::ceil(threads * there / static_cast<double>(threads_there)));
  }
  // Nobody is sent away from work: the last of it is spread over all who are there.
  wanted = std::max<double>(wanted, busy);
  // Who is in quarantine has a place and does nothing in it.
  wanted += wanted > 0 ? quarantined : 0;
  return static_cast<std::uint32_t>(std::min<double>(wanted, std::max(limits.max_workers, busy)));
}

std::uint32_t Coordinator::wanted_workers(Time now) const {
  return state_->wanted_workers(now);
}

bool Coordinator::wants_workers() const {
  return state_->wants_workers();
}

}  // namespace lightmill
