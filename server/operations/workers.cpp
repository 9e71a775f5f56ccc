// Operations on workers, and for autoscalers.
#include "common/base/text.h"
#include "server/operations/handlers.h"
#include "server/operations/pages.h"
#include "server/operations/worker_message.h"

namespace lightmill::handlers {
namespace {

constexpr std::string_view kMetric = "wanted-workers";

/// Replies with the worker after the change, if that succeeded; only with its name if it is gone.
Status changed_worker(const OperationContext& operation, const Status& change, const std::string& name,
                      v1::Worker* reply) {
  reply->set_name(name);
  if (change.ok()) {
    for (const WorkerStatus& worker : operation.context.farm.workers(operation.context.now)) {
      if (worker.name == name) {
        to_wire(worker, reply);
      }
    }
  }
  return change;
}

Status release(OperationContext& operation, const v1::ReleaseWorkerRequest& request) {
  return operation.context.farm.release_worker(request.name(), operation.context.now, operation.context.effects);
}

Status list(OperationContext& operation, const WorkerFilter& filter, v1::ListWorkersResponse* reply) {
  const std::vector<std::string>& notices = operation.runtime.options().notices;
  reply->mutable_notices()->Add(notices.begin(), notices.end());
  for (const WorkerStatus& worker : operation.context.farm.workers(operation.context.now, filter)) {
    to_wire(worker, reply->add_workers());
  }
  reply->set_wanted_workers(operation.context.farm.wanted_workers(operation.context.now));
  return ok_status();
}

}  // namespace

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
  FarmLoop::TaskContext& context = operation.context;
  return changed_worker(operation, context.farm.drain_worker(request.name(), context.now, context.effects),
                        request.name(), reply);
}

Status quarantine_worker(OperationContext& operation, const v1::QuarantineWorkerRequest& request, v1::Worker* reply) {
  if (!request.reason().empty()) {
    LM_RETURN_IF_ERROR(check_name("the reason", request.reason()));
  }
  const std::string& caller = operation.call.caller.name;
  const std::string reason = fmt::format("{}{}{}{}", kByHand, caller.empty() ? "hand" : caller,
                                         request.reason().empty() ? "" : ": ", request.reason());
  FarmLoop::TaskContext& context = operation.context;
  return changed_worker(
      operation,
      context.farm.quarantine_worker(request.name(), reason, request.render_again(), context.now, context.effects),
      request.name(), reply);
}

Status release_worker(OperationContext& operation, const v1::ReleaseWorkerRequest& request,
                      v1::ReleaseWorkerResponse*) {
  return release(operation, request);
}

Status release_and_show_worker(OperationContext& operation, const v1::ReleaseWorkerRequest& request,
                               v1::Worker* reply) {
  return changed_worker(operation, release(operation, request), request.name(), reply);
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

}  // namespace lightmill::handlers
