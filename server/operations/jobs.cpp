// Operations on jobs.
#include <set>

#include "common/wire/farm_messages.h"
#include "server/operations/handlers.h"
#include "server/operations/pages.h"

namespace lightmill::handlers {
namespace {

constexpr Rpc kGetJob{kRenderService, "GetJob", Right::see_job};

constexpr Rpc controlling_job(std::string_view method) {
  return {kRenderService, method, Right::control_job, kRecorded};
}

/// Replies with the job after the change, if that succeeded. The reply is sent when the change is durable.
Status changed_job(const OperationContext& operation, const Status& change, v1::Job* reply) {
  LM_RETURN_IF_ERROR(change);
  const FarmLoop::TaskContext& context = operation.context;
  LM_ASSIGN_OR_RETURN(const JobStatus status, context.farm.decided_status(JobId{operation.about.job}, context.now));
  to_wire(status, reply);
  return ok_status();
}

/// Filter for the jobs that the caller may see and asks for.
Result<JobFilter> filter_of(const OperationContext& operation, const v1::ListJobsRequest& request) {
  std::set<JobState> states;
  for (const int wire : request.states()) {
    LM_ASSIGN_OR_RETURN(const JobState state, from_wire(static_cast<v1::JobState>(wire)));
    states.insert(state);
  }
  return JobFilter{.unfinished = request.unfinished(),
                   .states = std::move(states),
                   .admits = [&caller = operation.call.caller, &request](const JobRecord& job) {
                     return may_see_job(caller, job.spec.owner) &&
                            (request.owner().empty() || request.owner() == job.spec.owner) &&
                            job.spec.name.find(request.name()) != std::string::npos;
                   }};
}

Status list_jobs(OperationContext& operation, const v1::ListJobsRequest& request, v1::ListJobsResponse* reply) {
  LM_ASSIGN_OR_RETURN(const int size, page_size_of(request.page_size()));
  LM_ASSIGN_OR_RETURN(const std::uint64_t before, id_in(request.page_token()));
  LM_ASSIGN_OR_RETURN(JobFilter filter, filter_of(operation, request));
  if (before > 0) {
    filter.before = JobId{before};
  } else {
    reply->set_total(operation.context.farm.count_jobs(filter));
  }
  filter.most = static_cast<std::size_t>(size) + 1;
  const std::vector<std::string>& notices = operation.runtime.options().notices;
  reply->mutable_notices()->Add(notices.begin(), notices.end());
  for (const JobStatus& job : operation.context.farm.jobs(operation.context.now, filter)) {
    if (reply->jobs_size() == size) {
      reply->set_next_page_token(std::to_string(reply->jobs(size - 1).id()));
    } else {
      to_wire(job, reply->add_jobs());
    }
  }
  operation.entries = static_cast<std::size_t>(reply->jobs_size());
  return ok_status();
}

Status get_job(OperationContext& operation, const v1::GetJobRequest& request, v1::Job* reply) {
  const FarmLoop::TaskContext& context = operation.context;
  LM_ASSIGN_OR_RETURN(const JobStatus status, context.farm.status(JobId{request.id()}, context.now));
  to_wire(status, reply);
  return ok_status();
}

Status get_spec(OperationContext& operation, const v1::GetJobRequest& request, v1::JobSpec* reply) {
  LM_ASSIGN_OR_RETURN(const JobSpec* const spec, operation.context.farm.spec(JobId{request.id()}));
  to_wire(*spec, reply);
  return ok_status();
}

Status cancel_job(OperationContext& operation, const v1::CancelJobRequest& request, v1::Job* reply) {
  FarmLoop::TaskContext& context = operation.context;
  return changed_job(operation, context.farm.cancel(JobId{request.id()}, context.now, context.unix_ms, context.effects),
                     reply);
}

Status pause_job(OperationContext& operation, const v1::PauseJobRequest& request, v1::Job* reply) {
  return changed_job(
      operation, operation.context.farm.pause(JobId{request.id()}, operation.context.now, operation.context.effects),
      reply);
}

Status resume_job(OperationContext& operation, const v1::ResumeJobRequest& request, v1::Job* reply) {
  return changed_job(
      operation, operation.context.farm.resume(JobId{request.id()}, operation.context.now, operation.context.effects),
      reply);
}

Status extend_job(OperationContext& operation, const v1::ExtendJobRequest& request, v1::Job* reply) {
  FarmLoop::TaskContext& context = operation.context;
  const Extension extension{request.samples(), request.error()};
  return changed_job(operation, context.farm.extend(JobId{request.id()}, extension, context.now, context.effects),
                     reply);
}

Status set_priority(OperationContext& operation, const v1::SetPriorityRequest& request, v1::Job* reply) {
  LM_RETURN_IF_ERROR(operation.runtime.access().check_priority(operation.call.caller, request.priority()));
  FarmLoop::TaskContext& context = operation.context;
  return changed_job(operation,
                     context.farm.set_priority(JobId{request.id()}, request.priority(), context.now, context.effects),
                     reply);
}

Status delete_job(OperationContext& operation, const v1::DeleteJobRequest& request, v1::DeleteJobResponse*) {
  FarmLoop::TaskContext& context = operation.context;
  const JobId id{request.id()};
  return request.cancel() ? context.farm.discard(id, context.now, context.unix_ms, context.effects)
                          : context.farm.remove(id, context.now, context.effects);
}

}  // namespace

std::vector<Operation> job_operations() {
  return {
      {kListJobs, "GET jobs?page_size=1..1000&page_token", on_farm(list_jobs)},
      {kGetJob, "GET jobs/{id}", on_job(get_job)},
      // Base64, with more than one copy while it is sent.
      {kGetJob, "GET jobs/{id}/spec", on_job(get_spec), {.http_only = true, .json_factor = 2}},
      {controlling_job("CancelJob"), "POST jobs/{id}/cancel", on_job(cancel_job)},
      {controlling_job("PauseJob"), "POST jobs/{id}/pause", on_job(pause_job)},
      {controlling_job("ResumeJob"), "POST jobs/{id}/resume", on_job(resume_job)},
      {controlling_job("ExtendJob"), "POST jobs/{id}/extend", on_job(extend_job), {.with_film = true}},
      {controlling_job("SetPriority"), "POST jobs/{id}/priority", on_job(set_priority)},
      {controlling_job("DeleteJob"), "POST jobs/{id}/delete", on_job(delete_job)},
  };
}

}  // namespace lightmill::handlers
