// lightmill top
#include <unistd.h>

#include <nlohmann/json.hpp>

#include <limits>

#include "client/cli/async_call.h"
#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/job_json.h"
#include "client/cli/progress.h"
#include "client/cli/screen.h"
#include "client/cli/top_view.h"
#include "client/cli/units.h"
#include "common/base/text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

constexpr double kMinInterval = 0.1, kMaxInterval = kDaySeconds;  // seconds
constexpr Duration kTick = std::chrono::milliseconds(50);         // interval of checks for keys and the window's size
constexpr Duration kSilence = std::chrono::seconds(3);            // silence below this is not reported

constexpr const char* kTopFooter =
    "q or Ctrl-C ends it. With --json, or if standard output is no terminal that can redraw, it prints once.";

struct TopOptions {
  bool once = false;
  std::string interval = "2s";
};

Result<double> parse_interval(std::string_view text) {
  const Result<double> seconds = parse_time(text);
  return seconds.ok() && *seconds >= kMinInterval && *seconds <= kMaxInterval
             ? seconds
             : invalid_argument("a time from 0.1s to 1d is expected, such as 0.5s or 1m, got '{}'", printable(text));
}

Result<TopSnapshot> fetch_snapshot(CoordinatorClient& connection) {
  v1::ListJobsRequest unfinished;
  unfinished.set_unfinished(true);
  LM_ASSIGN_OR_RETURN(ListedJobs jobs, connection.list_jobs(unfinished, std::numeric_limits<std::size_t>::max()));
  LM_ASSIGN_OR_RETURN(ListedWorkers workers, connection.list_workers());
  return TopSnapshot{connection.address(), std::move(jobs.items),      std::move(workers.items),
                     workers.wanted,       std::move(workers.notices), ""};
}

/// A snapshot of the farm in progress.
struct SnapshotCall : AsyncCall<TopSnapshot> {
  explicit SnapshotCall(CoordinatorClient& connection)
      : AsyncCall([&connection] { return fetch_snapshot(connection); }, [&connection] { connection.cancel_calls(); }) {}
};

nlohmann::json snapshot_json(const TopSnapshot& snapshot) {
  nlohmann::json jobs = nlohmann::json::array(), workers = nlohmann::json::array();
  for (const v1::Job& job : snapshot.jobs) {
    if (!has_ended(job.state())) {
      jobs.push_back(to_json(job));
    }
  }
  for (const v1::Worker& worker : snapshot.workers) {
    workers.push_back(to_json(worker));
  }
  return {{"jobs", jobs}, {"workers", workers}, {"wanted_workers", snapshot.wanted}, {"notices", snapshot.notices}};
}

/// CANCELLED where the user interrupts.
Result<TopSnapshot> first_snapshot(CoordinatorClient& connection, const Signals& signals) {
  SnapshotCall call(connection);
  while (!call.done(kTick)) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
  }
  return call.result();
}

/// Shows the farm, beginning with `snapshot`, until the user leaves.
void follow_farm(CoordinatorClient& connection, TopSnapshot snapshot, Duration interval, Signals& signals) {
  std::optional<SnapshotCall> call;
  Screen screen(signals);  // destroyed before `call`, which may take long to cancel: the terminal is restored first
  SteadyTime since = std::chrono::steady_clock::now();  // when the snapshot in progress began, or the last one ended
  std::optional<Screen::Size> shown;                    // of the screen's content; empty: out of date
  do {
    const SteadyTime now = std::chrono::steady_clock::now();
    if (call && call->done()) {
      Result<TopSnapshot> next = call->result();
      if (next.ok()) {
        snapshot = *std::move(next);
      } else {
        snapshot.trouble = message_of(next.status());
      }
      call.reset();
      since = now;
      shown.reset();
    } else if (!call && now - since >= interval) {
      call.emplace(connection);
      since = now;
    } else if (call && now - since >= kSilence) {
      const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(now - since);
      if (std::string trouble = fmt::format("no answer for {} s", seconds.count()); trouble != snapshot.trouble) {
        snapshot.trouble = std::move(trouble);
        shown.reset();
      }
    }
    if (const Screen::Size size = Screen::size(); shown != size) {
      Screen::show(top_lines(snapshot, size.columns, size.rows, colors_wanted()));
      shown = size;
    }
  } while (!screen.quit_requested(kTick));
}

Result<ExitCode> top(Context& context, const Console& console, const TopOptions& options) {
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<CoordinatorClient> connection, connect(context.common, console));
  Result<TopSnapshot> snapshot = first_snapshot(*connection, context.signals);
  if (!snapshot.ok()) {
    return console.fail(snapshot.status());
  }
  if (options.once || console.json() || !can_redraw(STDOUT_FILENO)) {
    console.object(snapshot_json(*snapshot));
    for (const std::string& line : top_lines(*snapshot, output_columns(STDOUT_FILENO), 0)) {
      console.result(line);
    }
    return kDone;
  }
  const std::chrono::duration<double> interval(*parse_interval(options.interval));
  follow_farm(*connection, *std::move(snapshot), std::chrono::duration_cast<Duration>(interval), context.signals);
  return kDone;
}

}  // namespace

void add_top_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<TopOptions>();
  CLI::App* command = app.add_subcommand("top", "Watch the farm: its unfinished jobs and its workers.");
  command->footer(kTopFooter);
  command->add_flag("--once", options->once, "print once, and end");
  command->add_option("--interval", options->interval, "time between updates, e.g. 0.5s or 1m; from 0.1s to 1d")
      ->type_name("TIME")
      ->check(readable(parse_interval))
      ->capture_default_str();
  add_common_options(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return top(context, console, *options); };
  });
}

}  // namespace lightmill::cli
