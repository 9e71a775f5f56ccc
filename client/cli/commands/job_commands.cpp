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
#include "common/base/suggestion.h"
#include "common/film/sample_range.h"
#include "common/wire/farm_messages.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

struct JobOptions {
  std::vector<std::uint64_t> jobs;
  std::uint64_t samples = 0;
  std::string error;
  std::int32_t priority = 0;
  bool cancel = false;
};

/// Columns of the table that stand in any terminal: those up to METHOD.
constexpr std::size_t kNameColumn = 1, kColumnsKept = 8;

std::vector<std::string> table_row(const v1::Job& job, std::int64_t now_ms) {
  const bool running = job.state() == v1::JOB_STATE_RUNNING;
  return {std::to_string(job.id()),
          job.name(),
          state_name(job.state()),
          fmt::format("{:.0f}%", std::floor(100 * fraction_done(job))),
          short_samples_count(job),
          error_text(job).empty() ? "-" : error_text(job),
          running && job.reason().empty() && job.eta_seconds() >= 0 ? rough_seconds(job.eta_seconds()) : "-",
          method_text(job),
          job.owner(),
          human_day(job.submitted_unix_ms(), now_ms),
          fmt::format("{}x{}", job.width(), job.height())};
}

Result<JobState> parse_state(std::string_view text) {
  std::vector<std::string> names;
  for (const JobState state : kJobStates) {
    names.emplace_back(name_of(state));
    if (text == names.back()) {
      return state;
    }
  }
  return invalid_argument("{}", unknown_text("state", text, names));
}

constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

struct ListOptions {
  std::vector<std::string> states;
  std::string owner, name;
  std::size_t limit = 20;
  bool all = false;
};

/// The newest jobs, and all older ones that are running if no states are asked for. A notice counts older ones that wait.
Result<ListedJobs> newest_and_running(CoordinatorClient& connection, v1::ListJobsRequest request, std::size_t limit) {
  LM_ASSIGN_OR_RETURN(ListedJobs listed, connection.list_jobs(request, limit));
  if (request.states_size() > 0 || listed.items.empty() || listed.items.size() >= listed.total) {
    return listed;
  }
  request.add_states(to_wire(JobState::queued));
  request.add_states(to_wire(JobState::paused));
  LM_ASSIGN_OR_RETURN(const ListedJobs waiting, connection.list_jobs(request, 1));
  const auto shown = static_cast<std::uint64_t>(std::ranges::count_if(listed.items, [](const v1::Job& job) {
    return job.state() == v1::JOB_STATE_QUEUED || job.state() == v1::JOB_STATE_PAUSED;
  }));
  if (waiting.total > shown) {
    listed.notices.push_back(
        fmt::format("older jobs that are queued or paused: {} (--state queued,paused)", waiting.total - shown));
  }
  request.clear_states();
  request.add_states(to_wire(JobState::running));
  LM_ASSIGN_OR_RETURN(ListedJobs running, connection.list_jobs(std::move(request), kNoLimit));
  const std::uint64_t oldest = listed.items.back().id();
  for (v1::Job& job : running.items) {
    if (job.id() < oldest) {
      listed.items.push_back(std::move(job));
    }
  }
  return listed;
}

Status list_jobs(CoordinatorClient& connection, const Console& console, const ListOptions& options) {
  v1::ListJobsRequest request;
  for (const std::string& state : options.states) {
    LM_ASSIGN_OR_RETURN(const JobState parsed, parse_state(state));
    request.add_states(to_wire(parsed));
  }
  request.set_owner(options.owner);
  request.set_name(options.name);
  LM_ASSIGN_OR_RETURN(const ListedJobs listed,
                      newest_and_running(connection, std::move(request), options.all ? kNoLimit : options.limit));
  const std::vector<v1::Job>& jobs = listed.items;
  json objects = json::array();
  const std::int64_t now_ms = system_clock().unix_milliseconds();
  Rows rows{{"JOB", "NAME", "STATE", "DONE", "SAMPLES", "ERROR", "ETA", "METHOD", "OWNER", "SUBMITTED", "SIZE"}};
  for (const v1::Job& job : jobs) {
    objects.push_back(to_json(job));
    rows.push_back(table_row(job, now_ms));
  }
  console.notices(listed.notices);
  console.object(json{{"jobs", objects}, {"total", listed.total}, {"notices", listed.notices}});
  const bool chosen = !options.states.empty() || !options.owner.empty() || !options.name.empty();
  if (jobs.empty()) {
    console.result(chosen ? "no job matches" : "no jobs yet: `lightmill submit SCENE` queues one");
  } else {
    print_table(console, std::move(rows), {2, color_of_state}, {kNameColumn, kColumnsKept});
    if (jobs.size() < listed.total) {
      console.notice(fmt::format("{} of {} jobs; --all lists all", jobs.size(), listed.total));
    }
    console.notices(wait_texts(jobs, jobs.size()));
  }
  return ok_status();
}

/// A command's action on a job.
struct Done {
  json object;
  std::string line;
};

Result<Done> done(const Result<v1::Job>& job) {
  LM_RETURN_IF_ERROR(job.status());
  return Done{to_json(*job), fmt::format("job {} is {} ({})", job->id(), state_name(job->state()), samples_text(*job))};
}

using JobCall = std::function<Result<Done>(CoordinatorClient&, const JobOptions&, std::uint64_t job)>;

/// Makes the call for each job, and continues after a failure. A farm that does not answer ends the loop.
ExitCode call_for_each(CoordinatorClient& connection, const Console& console, const JobOptions& options,
                       const JobCall& call) {
  json objects = json::array(), failed = json::array();
  Status failure = ok_status();
  for (const std::uint64_t job : options.jobs) {
    const Result<Done> result = call(connection, options, job);
    if (result.ok()) {
      console.result(result->line);
      objects.push_back(result->object);
      continue;
    }
    failure = result.status();
    if (options.jobs.size() == 1 || exit_code_of(failure) == kUnreachable) {
      break;
    }
    const std::string message = message_of(failure), subject = fmt::format("job {}", job);
    const bool named = message.starts_with(subject + " ") || message.ends_with(" " + subject);
    console.notice(named ? message : fmt::format("{}: {}", subject, message));
    failed.push_back({{"id", job}, {"message", message_of(failure)}});
  }
  if (options.jobs.size() == 1) {
    if (!failure.ok()) {
      return console.fail(failure);
    }
    console.object(objects[0]);
    return kDone;
  }
  const json all{{"jobs", objects}, {"failed", failed}};
  if (failure.ok()) {
    console.object(all);
    return kDone;
  }
  if (exit_code_of(failure) != kUnreachable) {
    failure = make_error(failure.code(), "failed for {} of {} jobs", failed.size(), options.jobs.size());
  }
  return console.fail(failure, all);
}

CLI::App* add_job_command(CLI::App& app, Context& context, const std::shared_ptr<JobOptions>& options, const char* name,
                          const char* about, const JobCall& call) {
  CLI::App* command = app.add_subcommand(name, about);
  command->add_option("JOB", options->jobs, "the jobs' numbers, as `submit` and `jobs` print them")
      ->required()
      ->check(job_number());
  add_common_options(*command, context);
  command->callback([&context, options, call] {
    context.run = [&context, options, call](const Console& console) {
      ExitCode code = kDone;
      const ExitCode connected = with_farm(console, context.common, [&](CoordinatorClient& connection) {
        code = call_for_each(connection, console, *options, call);
        return ok_status();
      });
      return connected == kDone ? code : connected;
    };
  });
  return command;
}

}  // namespace

void add_job_commands(CLI::App& app, Context& context) {
  const auto options = std::make_shared<JobOptions>();

  CLI::App* jobs = app.add_subcommand("jobs", "List the farm's jobs, newest first.");
  jobs->footer(
      "A ! after the method means that there are notices, for example about missing light. `lightmill show JOB` lists "
      "them.\n"
      "In a narrow terminal, long names lose their middle, and SIZE, SUBMITTED and OWNER are left out, in this order. If that "
      "is not enough, the last columns move below their row. "
      "`lightmill help output` says what sets the width.\n"
      "Mixed means that workers of every fingerprint class may render the job (--allow-mixed).");
  const auto list = std::make_shared<ListOptions>();
  jobs->add_option("--state", list->states,
                   "only jobs in these states: queued, running, paused, done, failed, cancelled")
      ->type_name("STATE,...")
      ->delimiter(',')
      ->check(readable(parse_state));
  jobs->add_option("--owner", list->owner, "only jobs of this owner")->type_name("NAME");
  jobs->add_option("--name", list->name, "only jobs whose name contains this")->type_name("TEXT");
  CLI::Option* const limit = jobs->add_option("--limit", list->limit,
                                              "list the N newest jobs, and without --state older ones that are running")
                                 ->type_name("N")
                                 ->check(whole_number(1, 100'000))
                                 ->capture_default_str();
  jobs->add_flag("--all", list->all, "list all jobs")->excludes(limit);
  add_common_options(*jobs, context);
  ask_farm(*jobs, context, [list](CoordinatorClient& connection, const Console& console) {
    return list_jobs(connection, console, *list);
  });

  const auto add = [&](const char* name, const char* about, const JobCall& call) {
    return add_job_command(app, context, options, name, about, call);
  };
  add("cancel", "Cancel jobs. Their pictures can still be fetched.",
      [](CoordinatorClient& connection, const JobOptions&, std::uint64_t job) {
        return done(connection.cancel_job(job));
      });
  add("pause", "Pause jobs. `resume` continues them.",
      [](CoordinatorClient& connection, const JobOptions&, std::uint64_t job) {
        return done(connection.pause_job(job));
      });
  add("resume", "Resume paused jobs.", [](CoordinatorClient& connection, const JobOptions&, std::uint64_t job) {
    return done(connection.resume_job(job));
  });

  add("priority", "Set the priority of jobs.",
      [](CoordinatorClient& connection, const JobOptions& given, std::uint64_t id) -> Result<Done> {
        LM_ASSIGN_OR_RETURN(const v1::Job job, connection.set_priority(id, given.priority));
        return Done{to_json(job), fmt::format("job {} has priority {}", job.id(), job.priority())};
      })
      ->add_option("--to", options->priority, "jobs with a higher priority go first. New jobs have 0")
      ->type_name("P")
      ->required()
      ->check(signed_whole_number(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()));

  CLI::App* extend = add("extend", "Raise the goal of jobs, also of finished ones.",
                         [](CoordinatorClient& connection, const JobOptions& given, std::uint64_t job) -> Result<Done> {
                           double error = 0;
                           if (!given.error.empty()) {
                             LM_ASSIGN_OR_RETURN(error, parse_error(given.error));
                           }
                           return done(connection.extend_job(job, given.samples, error));
                         });
  extend->footer(
      "Jobs continue where they stopped. Their samples have the same bits as if all had been requested at once. From "
      "then on,\nthe error is checked at 2^k and 3·2^k samples. Other limits stay, except those already reached.");
  CLI::Option_group* const limits = extend->add_option_group("limits");
  limits->add_option("--spp", options->samples, "the new total of samples per pixel")
      ->type_name("N")
      ->check(whole_number(1, kMaxSamples));
  limits->add_option("--error", options->error, "a smaller error (relMSE), with 95% confidence")
      ->type_name("E")
      ->check(readable(parse_error));
  limits->require_option(1, 2);

  add("delete", "Delete ended jobs and their films.",
      [](CoordinatorClient& connection, const JobOptions& given, std::uint64_t job) -> Result<Done> {
        const Status status = connection.delete_job(job, given.cancel);
        if (status.code() == StatusCode::kFailedPrecondition && !given.cancel) {
          return failed_precondition("{}. Give --cancel to cancel it first", message_of(status));
        }
        LM_RETURN_IF_ERROR(status);
        return Done{json{{"id", job}, {"deleted", true}}, fmt::format("job {} and its film are deleted", job)};
      })
      ->add_flag("--cancel", options->cancel, "cancel jobs first that have not ended");
}

}  // namespace lightmill::cli
