// lightmill jobs | cancel | pause | resume | priority | extend | delete
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/job_json.h"
#include "client/cli/progress.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/film/sample_range.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

constexpr std::size_t kDefaultJobs = 20;

struct JobOptions {
  std::uint64_t job = 0;
  std::uint64_t samples = 0;
  std::string error;
  std::int32_t priority = 0;
  std::size_t limit = kDefaultJobs;
  bool cancel = false;
};

std::vector<std::string> table_row(const v1::Job& job) {
  const bool running = job.state() == v1::JOB_STATE_RUNNING;
  return {std::to_string(job.id()),
          state_name(job.state()),
          fmt::format("{:.0f}%", std::floor(100 * fraction_done(job))),
          samples_text(job),
          error_text(job).empty() ? "-" : error_text(job),
          running && job.reason().empty() && job.eta_seconds() >= 0 ? human_seconds(job.eta_seconds()) : "-",
          fmt::format("{}x{}", job.width(), job.height()),
          method_text(job),
          job.owner(),
          human_date(job.submitted_unix_ms()),
          job.name()};
}

/// What jobs that are not done wait for, each thing once.
std::vector<std::string> waits_of(std::span<const v1::Job> jobs) {
  std::map<std::string, std::vector<std::uint64_t>> by_reason;
  for (const v1::Job& job : jobs) {
    if (!job.reason().empty() && (job.state() == v1::JOB_STATE_RUNNING || job.state() == v1::JOB_STATE_QUEUED)) {
      by_reason[job.reason()].push_back(job.id());
    }
  }
  std::vector<std::string> lines;
  for (const auto& [reason, ids] : by_reason) {
    lines.push_back(fmt::format("{} {}: {}", ids.size() == 1 ? "job" : "jobs", fmt::join(ids, ", "), reason));
  }
  return lines;
}

Status list_jobs(FarmConnection& connection, const Console& console, std::size_t limit) {
  LM_ASSIGN_OR_RETURN(const Listed<v1::Job> listed, connection.list_jobs(limit));
  const std::vector<v1::Job>& jobs = listed.items;
  json objects = json::array();
  std::vector<std::vector<std::string>> rows{
      {"JOB", "STATE", "DONE", "SAMPLES", "ERROR", "ETA", "SIZE", "METHOD", "OWNER", "SUBMITTED", "NAME"}};
  for (const v1::Job& job : jobs) {
    objects.push_back(to_json(job));
    rows.push_back(table_row(job));
  }
  console.notices(listed.notices);
  console.object(json{{"jobs", objects}, {"notices", listed.notices}});
  if (jobs.empty()) {
    console.result("no jobs yet: `lightmill submit SCENE` queues one");
  } else {
    print_table(console, rows);
    console.notices(waits_of(jobs));
  }
  return ok_status();
}

void say_job(const Console& console, const v1::Job& job) {
  console.object(to_json(job));
  console.result(fmt::format("job {} is {} ({})", job.id(), state_name(job.state()), samples_text(job)));
}

CLI::App* add_job_command(CLI::App& app, Context& context, JobOptions& options, const char* name, const char* about) {
  CLI::App* command = app.add_subcommand(name, about);
  add_job_number(*command, options.job);
  add_common_options(*command, context);
  return command;
}

/// A command that makes one call about one job and says how the job stands then.
using JobCall = std::function<Result<v1::Job>(FarmConnection&, const JobOptions&)>;

void run_call(CLI::App* command, Context& context, const std::shared_ptr<JobOptions>& options, const JobCall& call) {
  command->callback([&context, options, call] {
    context.run = [&context, options, call](const Console& console) {
      return with_farm(console, context.common, [&](FarmConnection& connection) -> Status {
        LM_ASSIGN_OR_RETURN(const v1::Job job, call(connection, *options));
        say_job(console, job);
        return ok_status();
      });
    };
  });
}

void add_delete(CLI::App& app, Context& context, const std::shared_ptr<JobOptions>& options) {
  CLI::App* command = add_job_command(app, context, *options, "delete", "Forget an ended job and its film.");
  command->add_flag("--cancel", options->cancel, "cancel it first, if it has not ended");
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) {
      return with_farm(console, context.common, [&](FarmConnection& connection) -> Status {
        LM_RETURN_IF_ERROR(connection.delete_job(options->job, options->cancel));
        console.object(json{{"id", options->job}, {"deleted", true}});
        console.result(fmt::format("job {} and its film are deleted", options->job));
        return ok_status();
      });
    };
  });
}

}  // namespace

void add_job_commands(CLI::App& app, Context& context) {
  const auto options = std::make_shared<JobOptions>();

  CLI::App* jobs = app.add_subcommand("jobs", "List the farm's jobs, newest first.");
  jobs->footer(
      "A ! after the method: its picture lacks some of the scene's light; `lightmill show JOB` says what. Mixed: "
      "workers\n"
      "of every fingerprint class may render it (--allow-mixed).");
  jobs->add_option("--limit", options->limit, "how many at most")
      ->check(whole_number(1, 100'000))
      ->capture_default_str();
  add_common_options(*jobs, context);
  jobs->callback([&context, options] {
    context.run = [&context, options](const Console& console) {
      return with_farm(console, context.common,
                       [&](FarmConnection& connection) { return list_jobs(connection, console, options->limit); });
    };
  });

  run_call(
      add_job_command(app, context, *options, "cancel", "End a job for good. What is rendered can still be fetched."),
      context, options,
      [](FarmConnection& connection, const JobOptions& given) { return connection.cancel_job(given.job); });
  run_call(add_job_command(app, context, *options, "pause", "Hold a job; `resume` lets it go on."), context, options,
           [](FarmConnection& connection, const JobOptions& given) { return connection.pause_job(given.job); });
  run_call(add_job_command(app, context, *options, "resume", "Let a paused job go on."), context, options,
           [](FarmConnection& connection, const JobOptions& given) { return connection.resume_job(given.job); });

  CLI::App* priority =
      add_job_command(app, context, *options, "priority", "Let a job go before others, or after them.");
  priority
      ->add_option("PRIORITY", options->priority, "jobs with a higher one go first; 0 is what jobs have by themselves")
      ->required()
      ->check(signed_whole_number(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()));
  run_call(priority, context, options, [](FarmConnection& connection, const JobOptions& given) {
    return connection.set_priority(given.job, given.priority);
  });

  CLI::App* extend = add_job_command(app, context, *options, "extend", "Ask more of a job, also of a finished one.");
  extend->footer(
      "It goes on where it stopped: more samples give the same bits as if they had been asked for at once, and an "
      "error is\n"
      "read at 2^k and 3·2^k samples from there on. Its other limits stay, but those that it has reached.");
  CLI::Option_group* const limits = extend->add_option_group("limits");
  limits->add_option("--spp", options->samples, "the new total of samples per pixel")
      ->check(whole_number(1, kMaxSamples));
  limits->add_option("--error", options->error, "a smaller error to be reached (relMSE)")
      ->type_name("E")
      ->check(readable(parse_error));
  limits->require_option(1, 2);
  run_call(extend, context, options, [](FarmConnection& connection, const JobOptions& given) -> Result<v1::Job> {
    double error = 0;
    if (!given.error.empty()) {
      LM_ASSIGN_OR_RETURN(error, parse_error(given.error));
    }
    return connection.extend_job(given.job, given.samples, error);
  });

  add_delete(app, context, options);
}

}  // namespace lightmill::cli
