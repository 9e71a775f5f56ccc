#include "client/cli/progress.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "client/cli/units.h"
#include "common/base/number_text.h"
#include "common/base/text_width.h"
#include "common/film/error_goal.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"

namespace lightmill::cli {
namespace {

constexpr int kMaxBar = 40;  // columns
constexpr int kMinBar = 5;
// Without a terminal: a line at each tenth of the progress, at most one a second, and at least one every ten seconds.
constexpr Duration kPlainAtLeastEvery = std::chrono::seconds(10);
constexpr Duration kPlainAtMostEvery = std::chrono::seconds(1);
constexpr double kPlainStep = 0.1;
// The error may seem to have reached its goal before it is checked.
constexpr double kMaxBeforeTheEnd = 0.99;

std::string bar(double fraction, int columns, bool color) {
  const int filled = static_cast<int>(std::floor(fraction * columns));
  return fmt::format("[{}{}{}{}]", color ? "\x1b[32m" : "", std::string(static_cast<std::size_t>(filled), '='),
                     color ? "\x1b[0m" : "", std::string(static_cast<std::size_t>(columns - filled), '.'));
}

/// A part of the line with a fixed number of columns, so that the bar keeps its width.
struct Field {
  std::string text;
  int columns = 0;
};

/// The upper end of the error's interval. It must fall to the goal.
double stated_error(const v1::Job& job) {
  return job.error().rel_mse() + job.error().half_width();
}

std::string tail_text(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_RUNNING:
      return job.eta_seconds() >= 0 ? "ETA " + human_seconds(job.eta_seconds()) : "ETA ?";
    case v1::JOB_STATE_DONE:
      return "done in " + human_seconds(job.active_seconds());
    default:
      return state_name(job.state());
  }
}

}  // namespace

std::string state_name(v1::JobState state) {
  const Result<JobState> known = from_wire(state);
  return known.ok() ? std::string(name_of(*known)) : "unknown";
}

std::string limit_name(v1::GoalLimit limit) {
  switch (limit) {
    case v1::GOAL_LIMIT_SAMPLES:
      return "samples";
    case v1::GOAL_LIMIT_SECONDS:
      return "seconds";
    case v1::GOAL_LIMIT_ERROR:
      return "error";
    default:
      return "";
  }
}

bool has_ended(v1::JobState state) {
  return state == v1::JOB_STATE_DONE || state == v1::JOB_STATE_FAILED || state == v1::JOB_STATE_CANCELLED;
}

double fraction_done(const v1::Job& job) {
  double fraction = job.state() == v1::JOB_STATE_DONE ? 1.0 : 0.0;
  if (job.samples_wanted() > 0) {
    fraction = std::max(fraction, static_cast<double>(job.samples_done()) / static_cast<double>(job.samples_wanted()));
  }
  if (job.goal().seconds() > 0) {
    fraction = std::max(fraction, job.active_seconds() / job.goal().seconds());
  }
  if (job.goal().error() > 0 && job.has_error() && !has_ended(job.state())) {
    // Errors fall as 1/samples.
    fraction = std::max(fraction, std::min(job.goal().error() / stated_error(job), kMaxBeforeTheEnd));
  }
  return std::clamp(fraction, 0.0, 1.0);
}

std::string error_goal_text(const v1::Job& job) {
  if (job.goal().error() <= 0 || !job.has_error()) {
    return "";
  }
  const bool waits = stated_error(job) <= job.goal().error() && !has_ended(job.state());
  return fmt::format("relMSE ≤{} (95%, goal {:g}{})", significant(stated_error(job), 2), job.goal().error(),
                     waits ? fmt::format(", next checked at {} spp", next_error_count(job.frame_samples() + 1)) : "");
}

std::string error_text(const v1::Job& job) {
  if (!job.has_error()) {
    return "";
  }
  const double percent = 100 * std::sqrt(std::max(job.error().rel_mse(), 0.0));
  return percent >= 9.95 ? fmt::format("±{:.0f}%", percent) : fmt::format("±{}%", significant(percent, 2));
}

std::string trace_text(const v1::Job& job) {
  const Result<Hash128> trace = hash_from_bytes(job.trace_id());
  return trace.ok() ? trace->hex() : "none";
}

std::string audits_text(const v1::Job& job) {
  const std::uint64_t audited = job.counters().results_audited(), unaudited = job.results_unaudited(),
                      merged = job.counters().results_merged();
  // These jobs forget which results were selected.
  const bool cut_short = job.state() == v1::JOB_STATE_CANCELLED || job.state() == v1::JOB_STATE_FAILED;
  std::string text;
  if (audited > 0) {
    text = fmt::format("audited by another identity, with the same bits: {} of {}", audited, counted(merged, "result"));
  } else if (job.audit_share() <= 0) {
    text = "unaudited: not requested";
  } else if (unaudited == 0 && merged > 0 && !cut_short) {
    text = fmt::format("unaudited: none of {} was selected at a share of {:.3g}%", counted(merged, "result"),
                       100 * job.audit_share());
  } else if (job.one_identity()) {
    text = "unaudited: one identity (all workers have the same certificate or token, or run on one machine)";
  } else if (cut_short) {
    text = "unaudited: it ended before an audit";
  } else if (job.state() == v1::JOB_STATE_DONE) {
    text = job.audits_lost() > 0
               ? fmt::format("unaudited: {} lost with their workers", counted(job.audits_lost(), "audit"))
               : "unaudited: no other identity was connected";
  } else {
    text = "no audits yet";
  }
  if (unaudited > 0) {
    text += fmt::format("; {} {}", counted(unaudited, "result"),
                        job.state() == v1::JOB_STATE_DONE ? "could not be audited"
                        : unaudited == 1                  ? "waits for an audit"
                                                          : "wait for an audit");
  }
  if (job.counters().nodes_dropped() > 0) {
    text += fmt::format("; rendered again because of wrong results or damage: {}",
                        counted(job.counters().nodes_dropped(), "node"));
  }
  return text;
}

std::string mixed_text(const v1::Job& job) {
  if (!job.allow_mixed()) {
    return "";
  }
  return "mixed: workers of every fingerprint class may render it. If they round differently, its bits cannot be "
         "reproduced (`lightmill help audits`)";
}

std::string method_name(const v1::Job& job) {
  const auto& candidates = job.method_notes().candidates();
  return candidates.empty() ? job.method() : fmt::format("{}", fmt::join(candidates, " or "));
}

/// The pilot's task before the first sample, or the task that it would have had.
std::string pilots_task(const v1::Job& job) {
  if (has_ended(job.state())) {
    return job.method_notes().candidates_size() > 1 ? "it ended before a pilot chose" : "it ended before its pilot";
  }
  return job.method_notes().candidates_size() > 1 ? "a pilot compares them" : "a pilot measures its noise";
}

std::string how_chosen(const v1::Job& job) {
  if (!job.method_notes().candidates().empty()) {
    return fmt::format(" ({})", pilots_task(job));
  }
  return job.method_notes().chosen() ? " (chosen by auto)" : "";
}

std::string method_text(const v1::Job& job) {
  return method_name(job) + (job.allow_mixed() ? ", mixed" : "") + (job.method_notes().notices().empty() ? "" : " !");
}

std::vector<std::string> method_lines(const v1::Job& job) {
  std::vector<std::string> lines;
  std::vector<std::string> reasons(job.method_notes().reasons().begin(), job.method_notes().reasons().end());
  if (!job.method_notes().candidates().empty()) {
    reasons.push_back(pilots_task(job));
  }
  if (!reasons.empty()) {
    lines.push_back(fmt::format("method {}: {}", method_name(job), reasons.front()));
    std::transform(reasons.begin() + 1, reasons.end(), std::back_inserter(lines),
                   [](const std::string& each) { return "  " + each; });
  }
  for (const std::string& notice : job.method_notes().notices()) {
    lines.push_back("note: " + notice);
  }
  if (job.allow_mixed()) {
    lines.push_back(fmt::format("note: {}", mixed_text(job)));
  }
  return lines;
}

std::string samples_count(const v1::Job& job) {
  return job.goal().samples() > 0 ? fmt::format("{}/{}", job.frame_samples(), job.goal().samples())
                                  : std::to_string(job.frame_samples());
}

std::string short_samples_count(const v1::Job& job) {
  constexpr std::uint64_t kMaxDigits = 100'000;
  const auto text = [](std::uint64_t count) {
    return count < kMaxDigits ? std::to_string(count) : human_count(static_cast<double>(count));
  };
  return job.goal().samples() > 0 ? fmt::format("{}/{}", text(job.frame_samples()), text(job.goal().samples()))
                                  : text(job.frame_samples());
}

int color_of_state(std::string_view state) {
  return state == "done"                             ? 32
         : state == "running"                        ? 36
         : state == "paused" || state == "cancelled" ? 33
         : state == "failed"                         ? 31
                                                     : 0;
}

std::string samples_text(const v1::Job& job) {
  return samples_count(job) + " spp";
}

namespace {

/// Ordered by priority in a narrow terminal.
std::vector<Field> fields_of(const v1::Job& job) {
  const std::string error = error_text(job);
  const bool rated = job.samples_per_second() > 0 && !has_ended(job.state());
  const std::string wanted = std::to_string(job.goal().samples());
  std::vector<Field> fields{
      {fmt::format("{:3.0f}%", std::floor(100 * fraction_done(job))), 4},
      {tail_text(job), static_cast<int>(std::string_view("ETA 13 min 39 s").size())},
      {error.empty() ? "" : "error " + error, static_cast<int>(std::string_view("error +0.12%").size())},
      {samples_text(job), static_cast<int>(job.goal().samples() > 0 ? 2 * wanted.size() + 5 : 10)},
      {rated ? human_rate(job.samples_per_second()) : "",
       static_cast<int>(std::string_view("1.23 Msamples/s").size())}};
  if (job.goal().error() > 0) {
    const int columns = columns_of(fmt::format("relMSE ≤0.0012 (95%, goal {:g})", job.goal().error()));
    fields.insert(fields.begin() + 2, {error_goal_text(job), columns});
  }
  return fields;
}

}  // namespace

std::vector<std::string> wait_texts(std::span<const v1::Job> jobs, std::size_t most) {
  std::map<std::string, std::vector<std::uint64_t>> by_reason;
  for (const v1::Job& job : jobs) {
    if (!job.reason().empty() && !has_ended(job.state()) && job.state() != v1::JOB_STATE_PAUSED) {
      by_reason[job.reason()].push_back(job.id());
    }
  }
  std::vector<std::string> lines;
  for (const auto& [reason, ids] : by_reason) {
    constexpr std::string_view kOneWaits = "waits ";
    const std::span<const std::uint64_t> named(ids.data(), std::min(ids.size(), most));
    const bool several = ids.size() > 1 && reason.starts_with(kOneWaits);
    lines.push_back(fmt::format("{} {}{}: {}", ids.size() == 1 ? "job" : "jobs", fmt::join(named, ", "),
                                named.size() < ids.size() ? fmt::format(" and {} more", ids.size() - named.size()) : "",
                                several ? "wait " + reason.substr(kOneWaits.size()) : reason));
  }
  return lines;
}

std::string range_text(std::uint64_t least, std::uint64_t most) {
  return least == most ? std::to_string(least) : fmt::format("{} to {}", least, most);
}

std::string samples_per_pixel(std::uint64_t least, std::uint64_t most) {
  return range_text(least, most) + (most == 1 ? " sample" : " samples");
}

std::string progress_text(const v1::Job& job, int width) {
  std::string line;
  for (const Field& field : fields_of(job)) {
    if (field.text.empty()) {
      continue;
    }
    const std::string longer = line.empty() ? field.text : line + "  " + field.text;
    if (columns_of(longer) <= width) {
      line = longer;
    }
  }
  return line;
}

std::string progress_line(const v1::Job& job, int width, bool color) {
  std::string text;
  for (const Field& field : fields_of(job)) {
    const int missing = std::max(field.columns - columns_of(field.text), 0);
    const std::string padded = field.text + std::string(static_cast<std::size_t>(missing), ' ');
    const std::string longer = text.empty() ? padded : text + "  " + padded;
    // A later field may be shorter.
    if (columns_of(longer) + kMinBar + 3 <= width || text.empty()) {
      text = longer;
    }
  }
  const int room = std::min(width - columns_of(text) - 3, kMaxBar);
  text.resize(text.find_last_not_of(' ') + 1);
  return room >= kMinBar ? bar(fraction_done(job), room, color) + " " + text : text;
}

bool ProgressPrinter::worth_a_line(const v1::Job& job) const {
  if (job.state() == v1::JOB_STATE_RUNNING && last_state_ == v1::JOB_STATE_QUEUED && fraction_done(job) == 0 &&
      job.eta_seconds() < 0) {
    return false;  // says no more than "queued" did
  }
  if (!shown_ || job.state() != last_state_) {
    return true;
  }
  const Duration since = clock_.now() - last_time_;
  return since >= kPlainAtLeastEvery ||
         (since >= kPlainAtMostEvery && fraction_done(job) >= last_fraction_ + kPlainStep);
}

double TimeLeft::update(double estimate_s, Time now) {
  constexpr double kPartOfEstimate = 8, kLeast = 0.5, kMost = 5;  // the memory, in parts and seconds
  const double passed_s = to_seconds(now - last_);
  last_ = now;
  if (estimate_s < 0 || shown_s_ < 0) {
    return shown_s_ = estimate_s;
  }
  const double counted_down_s = std::max(shown_s_ - passed_s, 0.0);
  const double memory_s = std::clamp(std::max(estimate_s, counted_down_s) / kPartOfEstimate, kLeast, kMost);
  shown_s_ = counted_down_s + (estimate_s - counted_down_s) * -std::expm1(-passed_s / memory_s);
  return shown_s_;
}

void ProgressPrinter::show(const v1::Job& from_farm) {
  if (console_.json()) {
    return;
  }
  v1::Job job = from_farm;
  job.set_eta_seconds(time_left_.update(job.state() == v1::JOB_STATE_RUNNING ? job.eta_seconds() : -1, clock_.now()));
  if (!notes_shown_ && job.id() != 0 && job.method_notes().candidates().empty()) {
    notes_shown_ = true;
    for (const std::string& line : method_lines(job)) {
      console_.notice(line);
    }
  }
  if (console_.terminal() && !console_.openjd()) {
    console_.redraw(progress_line(job, console_.width() - 3, console_.color()));  // with room for ^C
    if (has_ended(job.state())) {
      console_.end_redraw();
    }
    return;
  }
  if (!worth_a_line(job)) {
    return;
  }
  const std::string text = progress_text(job, std::numeric_limits<int>::max());
  console_.notice(text);
  console_.notify_manager(fraction_done(job), text);
  shown_ = true;
  last_time_ = clock_.now();
  last_fraction_ = fraction_done(job);
  last_state_ = job.state();
}

}  // namespace lightmill::cli
