// How a job's progress is shown: one line, redrawn in a terminal, repeated now and then without one.
#pragma once

#include <string>

#include "client/cli/console.h"
#include "common/base/clock.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// "queued", "running", …
std::string state_name(v1::JobState state);
/// "samples", "seconds", "error"; empty for none.
std::string limit_name(v1::GoalLimit limit);
/// Done, failed or cancelled.
bool has_ended(v1::JobState state);
/// Of its nearest limit, in [0, 1].
double fraction_done(const v1::Job& job);
/// "±1.2%": the frame's relative root-mean-square error, √relMSE; empty while it is not known.
std::string error_text(const v1::Job& job);
/// "relMSE 0.012/0.01": of a job that asks for an error, the upper end of what is known of it; empty without.
std::string error_goal_text(const v1::Job& job);
/// Of a list of jobs: with "mixed" where the job allows mixed fingerprint classes, and with a "!" where the picture
/// lacks some of the scene's light.
std::string method_text(const v1::Job& job);
/// "path"; of a job whose method a pilot is still to pick, those that it picks from: "path or caustic".
std::string method_name(const v1::Job& job);
/// Behind that: " (chosen by auto)", what a pilot does before the first sample or would have done, or nothing of a
/// method that was asked for.
std::string how_chosen(const v1::Job& job);
/// For people who wait for the picture: how its method was chosen, what of the light it lacks, and mixed_text.
std::vector<std::string> method_lines(const v1::Job& job);
/// "12/64 spp", or "12 spp" without a sample goal: what all of the frame has.
std::string samples_text(const v1::Job& job);

/// "3 of 412 results were rendered again by another identity, alike", or why nothing was: "unaudited: ...".
std::string verification_text(const v1::Job& job);

/// 32 hexadecimal digits: under which the logs of coordinator and workers have the job; "none" of a coordinator that
/// has none.
std::string trace_text(const v1::Job& job);

/// What a job costs that allows mixed fingerprint classes; empty of all others.
std::string mixed_text(const v1::Job& job);

/// "128", or "16 to 128".
std::string range_text(std::uint64_t least, std::uint64_t most);
/// "1 sample", "128 samples", "16 to 128 samples".
std::string samples_per_pixel(std::uint64_t least, std::uint64_t most);

/// Per cent, ETA, samples, error and rate, as many as fit into `width` columns (the first ones stay longest).
std::string progress_text(const v1::Job& job, int width);
/// The same behind a bar, where there is room for one.
std::string progress_line(const v1::Job& job, int width, bool color);

/// Shows a job as it changes.
class ProgressPrinter {
 public:
  ProgressPrinter(const Console& console, const Clock& clock) : console_(console), clock_(clock) {}
  void show(const v1::Job& job);

 private:
  bool worth_a_line(const v1::Job& job) const;

  const Console& console_;
  const Clock& clock_;
  bool notes_shown_ = false;
  bool shown_ = false;
  Time last_time_{};
  double last_fraction_ = 0;
  v1::JobState last_state_ = v1::JOB_STATE_UNSPECIFIED;
};

}  // namespace lightmill::cli
