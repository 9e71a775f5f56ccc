// lightmill workers [drain NAME | quarantine NAME | release NAME]
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/job_json.h"
#include "client/cli/table.h"
#include "client/cli/top_view.h"
#include "common/base/number_text.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

Status list_workers(CoordinatorClient& connection, const Console& console, const CommonOptions& common,
                    bool only_wanted) {
  LM_ASSIGN_OR_RETURN(const ListedWorkers listed, connection.list_workers());
  const std::vector<v1::Worker>& workers = listed.items;
  json objects = json::array();
  for (const v1::Worker& worker : workers) {
    objects.push_back(to_json(worker));
  }
  console.notices(listed.notices);
  console.object(json{{"workers", objects}, {"wanted_workers", listed.wanted}, {"notices", listed.notices}});
  if (only_wanted) {
    console.result(std::to_string(listed.wanted));
    return ok_status();
  }
  for (const v1::Worker& worker : workers) {
    if (!worker.quarantine().empty() && !is_shown_by_others(worker, workers)) {
      console.notice(fmt::format(
          "{} is in quarantine ({}). Check its machine, then release it with `lightmill workers release {}{}`",
          worker.name(), worker.quarantine(), worker.name(), common.farm_options()));
    }
  }
  if (workers.empty()) {
    console.result("no workers: " + how_to_start_a_worker(connection.address(), common));
  } else {
    print_table(console, worker_rows(workers), {1, color_of_activity});
    if (listed.wanted > workers.size()) {
      console.notice(fmt::format("jobs could keep {} busy", counted(listed.wanted, "worker")));
    }
  }
  return ok_status();
}

/// Drains the workers whose names begin with the name of this certificate or token. Returns how many there are.
Result<std::size_t> drain_workers_of(CoordinatorClient& connection, const Console& console,
                                     const std::string& identity) {
  LM_ASSIGN_OR_RETURN(const ListedWorkers listed, connection.list_workers());
  json objects = json::array();
  for (const v1::Worker& worker : listed.items) {
    if (!worker.away() && worker.name().starts_with(identity + "/")) {
      const Result<v1::Worker> drained = connection.drain_worker(worker.name());
      if (drained.status().code() == StatusCode::kNotFound) {
        continue;  // it has just left
      }
      LM_RETURN_IF_ERROR(drained.status());
      objects.push_back(to_json(*drained));
      console.result(fmt::format("worker {} finishes its tiles and leaves", worker.name()));
    }
  }
  if (!objects.empty()) {
    console.object(json{{"workers", objects}});
  }
  return objects.size();
}

Status drain_worker(CoordinatorClient& connection, const Console& console, const std::string& name) {
  const Result<v1::Worker> worker = connection.drain_worker(name);
  if (worker.status().code() == StatusCode::kNotFound) {
    LM_ASSIGN_OR_RETURN(const std::size_t drained, drain_workers_of(connection, console, name));
    return drained > 0 ? ok_status()
                       : not_found(
                             "{}, and no worker has a certificate or token of this name. `lightmill workers` "
                             "lists the workers",
                             message_of(worker.status()));
  }
  LM_RETURN_IF_ERROR(worker.status());
  console.object(to_json(*worker));
  console.result(fmt::format("worker {} finishes its tiles and leaves", name));
  return ok_status();
}

Status quarantine_worker(CoordinatorClient& connection, const Console& console,
                         const v1::QuarantineWorkerRequest& request) {
  LM_ASSIGN_OR_RETURN(const v1::Worker worker, connection.quarantine_worker(request));
  console.object(to_json(worker));
  console.result(fmt::format(
      "worker {} and all others of its identity are in quarantine ({}){}. Release them with `lightmill workers release "
      "{}`",
      request.name(), worker.quarantine(), request.render_again() ? ", and their results are rendered again" : "",
      request.name()));
  return ok_status();
}

Status release_worker(CoordinatorClient& connection, const Console& console, const std::string& name) {
  LM_RETURN_IF_ERROR(connection.release_worker(name));
  console.object(json{{"released", name}});
  console.result(fmt::format("worker {} and all others of its identity are released from quarantine", name));
  return ok_status();
}

}  // namespace

void add_worker_commands(CLI::App& app, Context& context) {
  CLI::App* workers = app.add_subcommand("workers", "List, drain, quarantine or release the farm's workers.");
  workers->require_subcommand(0, 1);
  const auto wanted = std::make_shared<bool>(false);
  workers->add_flag("--wanted", *wanted, "print only how many workers the farm could use now, for autoscalers");
  add_common_options(*workers, context);
  ask_farm(*workers, context, [&context, wanted](CoordinatorClient& connection, const Console& console) {
    return list_workers(connection, console, context.common, *wanted);
  });

  const auto name = std::make_shared<std::string>();
  CLI::App* drain = workers->add_subcommand("drain", "Let a worker finish its tiles and leave.");
  drain->footer("With the name of a certificate or token, all of its workers drain.");
  drain->add_option("NAME", *name, "the worker's name, as `workers` prints it, or the name of its certificate or token")
      ->required();
  add_common_options(*drain, context);
  ask_farm(*drain, context, [name](CoordinatorClient& connection, const Console& console) {
    return drain_worker(connection, console, *name);
  });

  const auto suspect = std::make_shared<v1::QuarantineWorkerRequest>();
  CLI::App* quarantine = workers->add_subcommand(
      "quarantine", "Give no work to a worker and all others of its identity until they are released.");
  quarantine->footer(
      "Their units go to other workers at once. The farm itself quarantines a worker whose result differs from that of "
      "two others.");
  quarantine
      ->add_option("NAME", *suspect->mutable_name(),
                   "the worker's name, as `workers` prints it, or the name of its certificate or token")
      ->required();
  quarantine->add_option("--reason", *suspect->mutable_reason(), "the reason that others see, one line");
  quarantine->add_flag_function(
      "--render-again", [suspect](std::int64_t) { suspect->set_render_again(true); },
      "also remove their results from all pictures, and render them again, also of done jobs");
  add_common_options(*quarantine, context);
  ask_farm(*quarantine, context, [suspect](CoordinatorClient& connection, const Console& console) {
    return quarantine_worker(connection, console, *suspect);
  });

  CLI::App* release =
      workers->add_subcommand("release", "Release a worker and all others of its identity from quarantine.");
  release->add_option("NAME", *name, "the worker's name, as `workers` prints it")->required();
  add_common_options(*release, context);
  ask_farm(*release, context, [name](CoordinatorClient& connection, const Console& console) {
    return release_worker(connection, console, *name);
  });
}

}  // namespace lightmill::cli
