// A job's progress as text: one line, redrawn in a terminal, repeated at intervals without one.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/cli/console.h"
#include "common/base/clock.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// "queued", "running", …
std::string state_name(v1::JobState state);
/// "samples", "seconds" or "error"; empty for none.
std::string limit_name(v1::GoalLimit limit);
/// Done, failed or cancelled.
bool has_ended(v1::JobState state);
/// The fraction done of the nearest limit, in [0, 1].
double fraction_done(const v1::Job& job);
/// "±1.2%", "±12%": the frame's relative root-mean-square error, √relMSE. Empty while it is unknown.
std::string error_text(const v1::Job& job);
/// "relMSE ≤0.012 (95%, goal 0.01)": the upper end of the 95% confidence interval, and the goal. Once it is below the
/// goal, also the samples at which the farm checks it next. Empty for a job without an error goal.
std::string error_goal_text(const v1::Job& job);
/// The method for a list of jobs. A job that allows mixed fingerprint classes has "mixed" after it. A job with
/// notices has "!".
std::string method_text(const v1::Job& job);
/// "path"; or the candidates, "path or caustic", while a pilot has not chosen.
std::string method_name(const v1::Job& job);
/// Text after the method's name: " (chosen by auto)", or what the pilot does or would have done. Empty for a method
/// that the user chose.
std::string how_chosen(const v1::Job& job);
/// Lines for users who wait for the picture: how the method was chosen, the light that it misses, and mixed_text.
std::vector<std::string> method_lines(const v1::Job& job);
/// "12/64", or "12" without a sample goal: the samples that every pixel has.
std::string samples_count(const v1::Job& job);
/// The same with a unit: "12/64 spp".
std::string samples_text(const v1::Job& job);
/// The counts for tables: "16.3 M/20.0 M" from 100,000 on.
std::string short_samples_count(const v1::Job& job);
/// The SGR code for a state: green, cyan, yellow, red. 0: none.
int color_of_state(std::string_view state);

/// "job 7: waits for a worker", "jobs 9, 8 and 3 more: wait for a worker": why unfinished jobs wait. A line has at most
/// `most` numbers.
std::vector<std::string> wait_texts(std::span<const v1::Job> jobs, std::size_t most);

/// "audited by another identity, with the same bits: 3 of 412 results", or "unaudited: " and the reason.
std::string audits_text(const v1::Job& job);

/// The trace id of the job in the logs of coordinator and workers, 32 hexadecimal digits. "none" if the coordinator has
/// none.
std::string trace_text(const v1::Job& job);

/// A warning for a job that allows mixed fingerprint classes. Empty for other jobs.
std::string mixed_text(const v1::Job& job);

/// "128", or "16 to 128".
std::string range_text(std::uint64_t least, std::uint64_t most);
/// "1 sample", "128 samples", "16 to 128 samples".
std::string samples_per_pixel(std::uint64_t least, std::uint64_t most);

/// Per cent, ETA, samples, error and rate, if they fit into `width` columns. The last ones are dropped first.
std::string progress_text(const v1::Job& job, int width);
/// The same after a bar, if there is room for one.
std::string progress_line(const v1::Job& job, int width, bool color);

/// A job's time left, smoothed: the moment of its end moves towards each new estimate, the more slowly the farther away
/// it is.
class TimeLeft {
 public:
  /// The seconds to show for the farm's estimate at `now`. Negative: unknown.
  double update(double estimate_s, Time now);

 private:
  Time last_{};
  double shown_s_ = -1;  ///< at last_
};

/// Prints a job's progress as it changes.
class ProgressPrinter {
 public:
  ProgressPrinter(const Console& console, const Clock& clock) : console_(console), clock_(clock) {}
  void show(const v1::Job& job);

 private:
  bool worth_a_line(const v1::Job& job) const;

  const Console& console_;
  const Clock& clock_;
  TimeLeft time_left_;
  bool notes_shown_ = false;
  bool shown_ = false;
  Time last_time_{};
  double last_fraction_ = 0;
  v1::JobState last_state_ = v1::JOB_STATE_UNSPECIFIED;
};

}  // namespace lightmill::cli
