// lightmill log
#include <algorithm>
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/table.h"
#include "client/cli/units.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxLast = 1'000'000;

struct LogOptions {
  std::uint64_t job = 0, last = 50;
  std::string caller, since;
};

std::string proof_of(const v1::Action& action) {
  switch (action.proof()) {
    case v1::PROOF_CERTIFICATE:
      return "certificate";
    case v1::PROOF_TOKEN:
      return "token " + action.token();
    default:
      return "-";
  }
}

std::string outcome_of(const v1::Action& action) {
  if (action.code() != 0) {
    return "refused: " + action.message();
  }
  return action.change().empty() ? "done" : action.change();
}

json action_json(const v1::Action& action) {
  json object{{"number", action.number()},
              {"unix_ms", action.unix_ms()},
              {"operation", action.operation()},
              {"peer", action.peer()},
              {"done", action.code() == 0}};
  const auto add = [&](const char* name, const std::string& text) {
    if (!text.empty()) {
      object[name] = text;
    }
  };
  add("caller", action.caller());
  if (action.proof() != v1::PROOF_NONE) {
    object["proof"] = action.proof() == v1::PROOF_TOKEN ? "token" : "certificate";
  }
  add("token", action.token());
  add("about", action.about());
  add("change", action.change());
  add("message", action.message());
  if (action.job() != 0) {
    object["job"] = action.job();
  }
  if (action.code() != 0) {
    object["code"] = action.code();
  }
  return object;
}

Status show_log(CoordinatorClient& connection, const Console& console, const LogOptions& options) {
  v1::ListActionsRequest request;
  request.set_job(options.job);
  request.set_caller(options.caller);
  if (!options.since.empty()) {
    LM_ASSIGN_OR_RETURN(const double seconds, parse_seconds(options.since));
    request.set_since_unix_ms(system_clock().unix_milliseconds() - static_cast<std::int64_t>(seconds * 1000));
  }
  LM_ASSIGN_OR_RETURN(std::vector<v1::Action> actions, connection.list_actions(request, options.last));
  std::ranges::reverse(actions);  // oldest first, as in a log
  json objects = json::array();
  std::vector<std::vector<std::string>> rows{{"WHEN", "CALLER", "OPERATION", "JOB", "ABOUT", "OUTCOME", "BY", "FROM"}};
  for (const v1::Action& action : actions) {
    objects.push_back(action_json(action));
    rows.push_back({human_moment(action.unix_ms()), action.caller().empty() ? "-" : action.caller(), action.operation(),
                    action.job() == 0 ? "-" : std::to_string(action.job()),
                    action.about().empty() ? "-" : action.about(), outcome_of(action), proof_of(action),
                    action.peer()});
  }
  console.object(json{{"actions", objects}});
  if (actions.empty()) {
    console.result("no recorded action matches");
  } else {
    print_table(console, rows);
  }
  return ok_status();
}

}  // namespace

void add_log_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<LogOptions>();
  CLI::App* command = app.add_subcommand("log", "Show the action log: who did what, and what was refused.");
  command->footer("Needs the role admin. docs/operate/security.md lists what is recorded, and how long it is kept.");
  add_common_options(*command, context);
  command->add_option("--job", options->job, "only actions on this job")->type_name("N")->check(job_number());
  command->add_option("--caller", options->caller, "only actions of this caller")->type_name("NAME");
  command->add_option("--since", options->since, "only actions newer than this: 90m, 2h, 7d, 4w")
      ->type_name("TIME")
      ->check(readable(parse_seconds));
  command->add_option("--last", options->last, "the newest N actions")
      ->type_name("N")
      ->check(whole_number(1, kMaxLast))
      ->capture_default_str();
  ask_farm(*command, context, [options](CoordinatorClient& connection, const Console& console) {
    return show_log(connection, console, *options);
  });
}

}  // namespace lightmill::cli
