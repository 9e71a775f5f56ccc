// Table of operations.
#include <algorithm>
#include <vector>

#include "common/wire/farm_messages.h"
#include "server/operations/handlers.h"

namespace lightmill {
namespace {

template <class Request, class Reply>
Handler handler_of(std::function<Result<Apply>(Runtime&, const Call&, Request&, Reply*)> begin) {
  return {&Request::default_instance(), &Reply::default_instance(), [](const WireMessage&) { return CallSubject(); },
          false,
          [begin = std::move(begin)](Runtime& runtime, const Call& call, WireMessage& request, WireMessage& reply) {
            return begin(runtime, call, static_cast<Request&>(request), static_cast<Reply*>(&reply));
          }};
}

/// Runs only on the caller's thread.
template <class Request, class Reply>
Handler at_once(Status (*answer)(Runtime&, const Request&, Reply*)) {
  return handler_of<Request, Reply>(
      [answer](Runtime& runtime, const Call&, Request& request, Reply* reply) -> Result<Apply> {
        LM_RETURN_IF_ERROR(answer(runtime, request, reply));
        return Apply();
      });
}

/// Starts on the caller's thread, and ends on the farm thread.
template <class Request, class Reply>
Handler in_two_steps(Result<Apply> (*begin)(Runtime&, const Call&, Request&, Reply*)) {
  return handler_of<Request, Reply>(begin);
}

/// Runs on the farm thread.
template <class Request, class Reply>
Handler on_farm(Status (*apply)(OperationContext&, const Request&, Reply*)) {
  return handler_of<Request, Reply>([apply](Runtime&, const Call&, Request& request, Reply* reply) -> Result<Apply> {
    return Apply([apply, &request, reply](OperationContext& operation) { return apply(operation, request, reply); });
  });
}

/// Runs on the farm thread for the job whose id the request has, if the caller may use it.
template <class Request, class Reply>
Handler on_job(Status (*apply)(OperationContext&, const Request&, Reply*)) {
  Handler handler = on_farm(apply);
  handler.about = [](const WireMessage& request) { return CallSubject{static_cast<const Request&>(request).id()}; };
  handler.of_job = true;
  return handler;
}

/// Runs on the farm thread for a worker or token that a field of the request names.
template <class Request, class Reply>
Handler named(const std::string& (Request::*name)() const, Status (*apply)(OperationContext&, const Request&, Reply*)) {
  Handler handler = on_farm(apply);
  handler.about = [name](const WireMessage& request) {
    return CallSubject{0, (static_cast<const Request&>(request).*name)()};
  };
  return handler;
}

Status fill_scene_json(WireMessage& reply) {
  return fill_scene(&static_cast<v1::InspectSceneResponse&>(reply));
}

constexpr std::uint64_t kMiB = 1 << 20;

}  // namespace

std::span<const Operation> operations() {
  using namespace handlers;
  static const std::vector<Operation> table{
      // A packed scene of 16 MiB and 10,000 assets in base64. The next two: most digests, most files.
      {Rpc::submit_job, "POST jobs", in_two_steps(submit_job), {.most_body_bytes = 24 * kMiB}},
      {Rpc::find_missing_assets, "POST assets/missing", at_once(find_missing_assets), {.most_body_bytes = kMiB}},
      // The reply has the scene as JSON, whose numbers take several times their bytes, and in base64.
      {Rpc::inspect_scene,
       "POST inspect",
       in_two_steps(inspect_scene),
       {.waits = true, .most_body_bytes = 4 * kMiB, .json_factor = 6, .fill_json = fill_scene_json}},

      {Rpc::list_jobs, "GET jobs?page_size=1..1000&page_token", on_farm(list_jobs)},
      {Rpc::get_job, "GET jobs/{id}", on_job(get_job)},
      // Base64, with more than one copy while it is sent.
      {Rpc::get_job, "GET jobs/{id}/spec", on_job(get_spec), {.http_only = true, .json_factor = 2}},
      {Rpc::cancel_job, "POST jobs/{id}/cancel", on_job(cancel_job)},
      {Rpc::pause_job, "POST jobs/{id}/pause", on_job(pause_job)},
      {Rpc::resume_job, "POST jobs/{id}/resume", on_job(resume_job)},
      {Rpc::extend_job, "POST jobs/{id}/extend", on_job(extend_job), {.with_film = true}},
      {Rpc::set_priority, "POST jobs/{id}/priority", on_job(set_priority)},
      {Rpc::delete_job, "POST jobs/{id}/delete", on_job(delete_job)},

      {Rpc::list_workers, "", on_farm(list_workers)},
      {Rpc::list_workers, "GET workers", on_farm(list_all_workers), {.http_only = true}},
      {Rpc::drain_worker, "POST workers/{name}/drain", named(&v1::DrainWorkerRequest::name, drain_worker)},
      {Rpc::quarantine_worker, "POST workers/{name}/quarantine",
       named(&v1::QuarantineWorkerRequest::name, quarantine_worker)},
      {Rpc::release_worker, "", named(&v1::ReleaseWorkerRequest::name, release_worker)},
      {Rpc::release_worker,
       "POST workers/{name}/release",
       named(&v1::ReleaseWorkerRequest::name, release_and_show_worker),
       {.http_only = true}},

      {Rpc::list_workers, "GET history?span=1..86400", on_farm(get_history), {.http_only = true}},
      {Rpc::list_workers,
       "GET events?page_size=1..1000&page_token&job&worker&kind",
       on_farm(list_events),
       {.http_only = true}},
      {Rpc::list_workers, "GET workers/{name}/history", on_farm(get_worker_history), {.http_only = true}},

      {Rpc::create_token, "", on_farm(create_token)},
      {Rpc::list_tokens, "", on_farm(list_tokens)},
      {Rpc::revoke_token, "", named(&v1::RevokeTokenRequest::id, revoke_token)},
      {Rpc::enrol, "", on_farm(enrol)},
      {Rpc::list_actions, "GET actions?page_size=1..1000&page_token&job&caller", on_farm(list_actions)},

      {Rpc::is_active, "", on_farm(is_active)},
      {Rpc::get_metric_spec, "", on_farm(get_metric_spec)},
      {Rpc::get_metrics, "", on_farm(get_metrics)},
  };
  return table;
}

const Operation* find_operation(Rpc rpc) {
  const auto found = std::ranges::find_if(
      operations(), [rpc](const Operation& each) { return each.rpc == rpc && !each.traits.http_only; });
  return found == operations().end() ? nullptr : &*found;
}

}  // namespace lightmill
