#include "server/domain/job_figures.h"

#include <bit>
#include <cmath>

#include "common/base/check.h"
#include "common/base/number_text.h"
#include "common/farm/job_rules.h"
#include "common/methods/spec/method_spec.h"
#include "server/domain/job.h"

namespace lightmill {
namespace {

/// More than a thousand fast threads render.
constexpr double kMaxPixelSamplesPerSecond = 1e9;

}  // namespace

std::uint64_t finished_bytes(const JobSpec& spec) {
  const std::uint64_t pixels = grid_of(spec.settings).pixel_count();
  const NodeLayout layout(spec.settings.layers);
  int parts = std::popcount(spec.goal.samples);
  if (spec.goal.seconds > 0) {
    // It may stop at any count up to `most`. A count with all bits set has most parts.
    double most = std::ceil(spec.goal.seconds * kMaxPixelSamplesPerSecond / static_cast<double>(pixels));
    most = std::min(most, static_cast<double>(spec.goal.samples > 0 ? spec.goal.samples : most_samples(spec.goal)));
    parts =
        std::bit_width(static_cast<std::uint64_t>(most) + 1) - 1 + (spec.goal.adaptive ? Allocation::kMaxDoublings : 0);
  }
  parts = std::max(parts, spec.goal.error > 0 ? 2 : 1);
  // The first samples lie in at most four of the parts.
  const std::uint64_t first = std::uint64_t{layout.first_mean + layout.first_nearest} * std::min(parts, 4) +
                              std::uint64_t{layout.first_samples} * kFirstSamples;
  return pixels * (static_cast<std::uint64_t>(parts) * layout.summed_values() + first) * sizeof(float);
}

std::string describe(const Goal& goal) {
  std::string text;
  if (goal.samples > 0) {
    text = counted(goal.samples, "sample") + " per pixel";
  }
  if (goal.seconds > 0) {
    text += fmt::format("{}{} second{}", text.empty() ? "" : " or ", goal.seconds, goal.seconds == 1 ? "" : "s");
  }
  if (goal.error > 0) {
    text += fmt::format("{}error {}", text.empty() ? "" : " or ", goal.error);
  }
  if (goal.adaptive) {
    text += ", adaptive";
  }
  return text;
}

Result<Goal> extended_goal(const Job& job, const Extension& to, Time now) {
  Goal goal = job.spec().goal;
  // Reached limits would end the job at once.
  if (job.time_is_up(now)) {
    goal.seconds = 0;
  }
  if (to.error != 0) {
    LM_RETURN_IF_ERROR(with_context(check_goal_error(to.error), "error"));
    if (goal.error != 0 && to.error >= goal.error) {
      return invalid_argument("error: must be less than before, got {} after {}", to.error, goal.error);
    }
    const RenderSettings& settings = job.spec().settings;
    LM_RETURN_IF_ERROR(with_context(check_method_error(settings.method, to.error), "error"));
    if (may_gather(settings, job.record().method_notes) && NodeLayout(settings.layers).bias < 0) {
      return failed_precondition(
          "the film has no layer \"bias\", so its error cannot be a goal: the method may gather photons. Extend the job with "
          "--spp, or submit the scene again with --error");
    }
    goal.error = to.error;
  } else if (job.record().reached == GoalLimit::error) {
    goal.error = 0;
  }
  if (to.samples == 0 && to.error == 0) {
    return invalid_argument("more samples or a smaller error must be given");
  }
  if (to.samples > 0) {
    // A goal must not lie below samples that are leased, or merged beyond a gap. Else a count n would not mean samples
    // [0, n). A done job may have ended before its limit of samples.
    const std::uint64_t before = std::max(has_ended(job.state()) ? 0 : goal.samples, job.samples_end());
    if (to.samples <= before || to.samples > most_samples(goal)) {
      return invalid_argument("samples (--spp) must be the new total, more than {} and at most {}, got {}", before,
                              most_samples(goal), to.samples);
    }
    goal.samples = to.samples;
  } else if (job.outline().frame_samples() >= goal.samples) {
    goal.samples = 0;
  }
  LM_RETURN_IF_ERROR(check_goal(goal, job.spec().settings.crop));
  return goal;
}

double expected_pixel_samples(const Job& job, const FrameError& error) {
  const Goal& goal = job.spec().goal;
  const double each = static_cast<double>(job.outline().grid().pixel_count()) * job.outline().mean_share();
  const auto done = static_cast<double>(job.outline().pixel_samples());
  double count = goal.samples > 0 ? static_cast<double>(goal.samples) : std::numeric_limits<double>::infinity();
  if (goal.error > 0 && error.known) {
    const std::uint64_t enough = expected_error_count(error, done / each, goal.error, job.first_error_count());
    count = std::min(count, static_cast<double>(std::max(enough, job.plan().goal())));
  }
  return std::max(count * each - done, 0.0);
}

double expected_seconds(const Job& job, const FrameError& error, Time now) {
  const Goal& goal = job.spec().goal;
  double seconds = job.seconds_for(expected_pixel_samples(job, error), now);
  if (goal.seconds > 0) {
    seconds = std::min(seconds, std::max(goal.seconds - job.active_seconds(now), 0.0));
  }
  return seconds;
}

bool is_whole(const Job& job) {
  switch (job.record().reached) {
    case GoalLimit::error:
      return job.error_met();
    case GoalLimit::samples:
      return job.outline().frame_samples() >= job.sample_limit();
    case GoalLimit::seconds:
      return job.outline().min_samples() > 0 && !job.has_gaps();
    case GoalLimit::none:
      break;
  }
  LM_CHECK(false, "job {} is done, and no limit has ended it", job.id().value);
}

}  // namespace lightmill
