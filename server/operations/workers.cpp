// Operations on workers, and for autoscalers.
#include "common/base/text.h"
#include "server/operations/changes.h"
#include "server/operations/handlers.h"
#include "server/operations/messages.h"
#include "server/operations/pages.h"

namespace lightmill::handlers {
namespace {

constexpr std::string_view kMetric = "wanted-workers";

constexpr Rpc controlling_farm(std::string_view method) {
  return {kRenderService, method, Right::control_farm, kRecorded};
}

constexpr Rpc scaling(std::string_view method) {
  return {kScalerService, method, Right::see_farm};
}

/// The worker; only its name if the farm does not know it.
WorkerStatus find_worker(const OperationContext& operation, const std::string& name) {
  WorkerStatus found;
  found.name = name;
  found.threads = 0;
  for (WorkerStatus& worker : operation.context.farm.workers(operation.context.now)) {
    if (worker.name == name) {
      found = std::move(worker);
    }
  }
  return found;
}

/// Applies `change`, and notes for the action log what it changes. Replies with the worker.
Status change_worker(OperationContext& operation, const std::string& name, v1::Worker* reply,
                     const std::function<Status(FarmLoop::TaskContext&)>& change) {
  const WorkerStatus before = find_worker(operation, name);
  LM_RETURN_IF_ERROR(change(operation.context));
  const WorkerStatus after = find_worker(operation, name);
  operation.about.change = describe_change(before, after);
  to_wire(after, reply);
  return ok_status();
}

Status list(OperationContext& operation, const WorkerFilter& filter, v1::ListWorkersResponse* reply) {
  const std::vector<std::string>& notices = operation.runtime.options().notices;
  reply->mutable_notices()->Add(notices.begin(), notices.end());
  if (const std::string& held = operation.context.farm.held(); !held.empty()) {
    reply->add_notices("all work " + held);
  }
  for (const WorkerStatus& worker : operation.context.farm.workers(operation.context.now, filter)) {
    to_wire(worker, reply->add_workers());
  }
  operation.entries = static_cast<std::size_t>(reply->workers_size());
  reply->set_wanted_workers(operation.context.farm.wanted_workers(operation.context.now));
  return ok_status();
}

Status list_workers(OperationContext& operation, const v1::ListWorkersRequest& request,
                    v1::ListWorkersResponse* reply) {
  LM_ASSIGN_OR_RETURN(const int size, page_size_of(request.page_size()));
  LM_RETURN_IF_ERROR(list(operation, {request.page_token(), static_cast<std::size_t>(size) + 1}, reply));
  if (reply->workers_size() > size) {
    reply->mutable_workers()->RemoveLast();
    reply->set_next_page_token(reply->workers(size - 1).name());
  }
  return ok_status();
}

Status list_all_workers(OperationContext& operation, const v1::ListWorkersRequest&, v1::ListWorkersResponse* reply) {
  return list(operation, {}, reply);
}

Status drain_worker(OperationContext& operation, const v1::DrainWorkerRequest& request, v1::Worker* reply) {
  return change_worker(operation, request.name(), reply, [&](FarmLoop::TaskContext& context) {
    return context.farm.drain_worker(request.name(), context.now, context.effects);
  });
}

Status quarantine_worker(OperationContext& operation, const v1::QuarantineWorkerRequest& request, v1::Worker* reply) {
  if (!request.reason().empty()) {
    LM_RETURN_IF_ERROR(check_name("the reason", request.reason()));
  }
  const std::string& caller = operation.call.caller.name;
  const std::string reason = fmt::format("{}{}{}{}", kByHand, caller.empty() ? "hand" : caller,
                                         request.reason().empty() ? "" : ": ", request.reason());
  LM_RETURN_IF_ERROR(change_worker(operation, request.name(), reply, [&](FarmLoop::TaskContext& context) {
    return context.farm.quarantine_worker(request.name(), reason, request.render_again(), context.now, context.effects);
  }));
  if (request.render_again()) {
    operation.about.change += operation.about.change.empty() ? "" : ", ";
    operation.about.change += "its results are rendered again";
  }
  return ok_status();
}

Status release_and_show_worker(OperationContext& operation, const v1::ReleaseWorkerRequest& request,
                               v1::Worker* reply) {
  return change_worker(operation, request.name(), reply, [&](FarmLoop::TaskContext& context) {
    return context.farm.release_worker(request.name(), context.now, context.effects);
  });
}

Status release_worker(OperationContext& operation, const v1::ReleaseWorkerRequest& request,
                      v1::ReleaseWorkerResponse*) {
  v1::Worker worker;
  return release_and_show_worker(operation, request, &worker);
}

Status is_active(OperationContext& operation, const externalscaler::ScaledObjectRef&,
                 externalscaler::IsActiveResponse* reply) {
  reply->set_result(operation.context.farm.wanted_workers(operation.context.now) > 0);
  return ok_status();
}

Status get_metric_spec(OperationContext&, const externalscaler::ScaledObjectRef&,
                       externalscaler::GetMetricSpecResponse* reply) {
  externalscaler::MetricSpec* const spec = reply->add_metricspecs();
  spec->set_metricname(std::string(kMetric));
  spec->set_targetsize(1);
  spec->set_targetsizefloat(1);
  return ok_status();
}

Status get_metrics(OperationContext& operation, const externalscaler::GetMetricsRequest& request,
                   externalscaler::GetMetricsResponse* reply) {
  if (request.metricname() != kMetric) {
    return invalid_argument("unknown metric '{}'. Known metrics: {}", request.metricname(), kMetric);
  }
  const std::uint32_t wanted = operation.context.farm.wanted_workers(operation.context.now);
  externalscaler::MetricValue* const value = reply->add_metricvalues();
  value->set_metricname(std::string(kMetric));
  value->set_metricvalue(wanted);
  value->set_metricvaluefloat(wanted);
  return ok_status();
}

}  // namespace

std::vector<Operation> worker_operations() {
  return {
      {kListWorkers, "", on_farm(list_workers)},
      {kListWorkers, "GET workers", on_farm(list_all_workers), {.http_only = true}},
      {controlling_farm("DrainWorker"), "POST workers/{name}/drain",
       named(&v1::DrainWorkerRequest::name, drain_worker)},
      {controlling_farm("QuarantineWorker"), "POST workers/{name}/quarantine",
       named(&v1::QuarantineWorkerRequest::name, quarantine_worker)},
      {controlling_farm("ReleaseWorker"), "", named(&v1::ReleaseWorkerRequest::name, release_worker)},
      {controlling_farm("ReleaseWorker"),
       "POST workers/{name}/release",
       named(&v1::ReleaseWorkerRequest::name, release_and_show_worker),
       {.http_only = true}},

      {scaling("IsActive"), "", on_farm(is_active)},
      {scaling("GetMetricSpec"), "", on_farm(get_metric_spec)},
      {scaling("GetMetrics"), "", on_farm(get_metrics)},
  };
}

}  // namespace lightmill::handlers
