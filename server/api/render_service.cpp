#include "server/api/render_service.h"

#include "common/wire/farm_messages.h"
#include "server/api/grpc_status.h"
#include "server/api/recorded_calls.h"
#include "server/operations/job_list.h"
#include "server/operations/pages.h"
#include "server/operations/submission.h"
#include "server/operations/worker_message.h"

namespace lightmill {
namespace {

Status show_job(const FarmLoop::Turn& turn, JobId job, v1::Job* reply) {
  LM_ASSIGN_OR_RETURN(const JobStatus status, turn.farm.status(job, turn.now));
  to_wire(status, reply);
  return ok_status();
}

}  // namespace

RenderServiceImpl::Unary* RenderServiceImpl::refuse(Context* context, const Status& status) {
  Unary* reactor = context->DefaultReactor();
  reactor->Finish(to_grpc(status));
  return reactor;
}

/// Runs `task` on the farm thread; the task finishes the call, now or after the commit.
RenderServiceImpl::Unary* RenderServiceImpl::on_farm(Context* context,
                                                     std::function<void(FarmLoop::Turn&, Unary*)> task) {
  Unary* reactor = context->DefaultReactor();
  if (!loop_.post([reactor, task = std::move(task)](FarmLoop::Turn& turn) { task(turn, reactor); })) {
    reactor->Finish(busy());
  }
  return reactor;
}

/// The same for a call that looks at a job, if the caller may.
RenderServiceImpl::Unary* RenderServiceImpl::on_job(Context* context, Rpc rpc, JobId job,
                                                    std::function<void(FarmLoop::Turn&, Unary*)> task) {
  Result<Call> call = admit(gate_, *context, rpc, {job.value});
  if (!call.ok()) {
    return refuse(context, call.status());
  }
  return on_farm(context,
                 [this, job, call = std::move(*call), task = std::move(task)](FarmLoop::Turn& turn, Unary* reactor) {
                   if (const Status status = check_job_call(turn, gate_, call, job); status.ok()) {
                     task(turn, reactor);
                   } else {
                     reactor->Finish(to_grpc(status));
                   }
                 });
}

/// Changes a job, if the caller may, and answers once the change is durable; with the job's state, if `reply` is given.
RenderServiceImpl::Unary* RenderServiceImpl::change_job(Context* context, Rpc rpc, JobId job, v1::Job* reply,
                                                        std::function<Status(FarmLoop::Turn&)> change) {
  return run_change(
      loop_, gate_, context, admit(gate_, *context, rpc, {job.value}),
      [this, job, reply, change = std::move(change)](FarmLoop::Turn& turn, const Call& call, About& about) {
        about.job = job.value;
        LM_RETURN_IF_ERROR(check_job_call(turn, gate_, call, job));
        LM_RETURN_IF_ERROR(change(turn));
        return reply == nullptr ? ok_status() : show_job(turn, job, reply);
      },
      rpc == Rpc::extend_job ? std::optional(job) : std::nullopt);
}

// ---- assets ----

RenderServiceImpl::Unary* RenderServiceImpl::FindMissingAssets(Context* context,
                                                               const v1::FindMissingAssetsRequest* request,
                                                               v1::FindMissingAssetsResponse* reply) {
  if (const Result<Call> call = admit(gate_, *context, Rpc::find_missing_assets); !call.ok()) {
    return refuse(context, call.status());
  }
  Unary* reactor = context->DefaultReactor();
  reactor->Finish(to_grpc(find_missing(assets_, *request, reply)));
  return reactor;
}

// ---- jobs ----

RenderServiceImpl::Unary* RenderServiceImpl::SubmitJob(Context* context, const v1::SubmitJobRequest* request,
                                                       v1::Job* reply) {
  const Result<Call> call = admit(gate_, *context, Rpc::submit_job);
  if (!call.ok()) {
    return refuse(context, call.status());
  }
  Result<Submission> submission = read_submission(*request, assets_);
  if (!submission.ok()) {
    return refuse(context, submission.status());
  }
  return run_change(
      loop_, gate_, context, call,
      [submission = *std::move(submission), reply](FarmLoop::Turn& turn, const Call& call, About& about) mutable {
        LM_RETURN_IF_ERROR(submit(turn, call, submission, about));
        return show_job(turn, JobId{about.job}, reply);
      });
}

RenderServiceImpl::Unary* RenderServiceImpl::GetJob(Context* context, const v1::GetJobRequest* request,
                                                    v1::Job* reply) {
  const JobId id{request->id()};
  return on_job(context, Rpc::get_job, id, [id, reply](FarmLoop::Turn& turn, Unary* reactor) {
    const Result<JobStatus> status = turn.farm.status(id, turn.now);
    if (status.ok()) {
      to_wire(*status, reply);
    }
    reactor->Finish(to_grpc(status.status()));
  });
}

RenderServiceImpl::Unary* RenderServiceImpl::ListJobs(Context* context, const v1::ListJobsRequest* request,
                                                      v1::ListJobsResponse* reply) {
  const Result<Call> call = admit(gate_, *context, Rpc::list_jobs);
  const Result<int> size = call.ok() ? page_size_of(request->page_size()) : call.status();
  const Result<std::uint64_t> before = id_in(request->page_token());
  if (!size.ok() || !before.ok()) {
    return refuse(context, size.ok() ? before.status() : size.status());
  }
  reply->mutable_notices()->Add(notices_.begin(), notices_.end());
  return on_farm(context, [caller = call->caller, page = JobPage{*size, *before, request->unfinished()}, reply](
                              FarmLoop::Turn& turn, Unary* reactor) {
    list_jobs(turn, caller, page, reply);
    reactor->Finish(grpc::Status::OK);
  });
}

RenderServiceImpl::Unary* RenderServiceImpl::CancelJob(Context* context, const v1::CancelJobRequest* request,
                                                       v1::Job* reply) {
  const JobId id{request->id()};
  return change_job(context, Rpc::cancel_job, id, reply,
                    [id](FarmLoop::Turn& turn) { return turn.farm.cancel(id, turn.now, turn.unix_ms, turn.effects); });
}

RenderServiceImpl::Unary* RenderServiceImpl::PauseJob(Context* context, const v1::PauseJobRequest* request,
                                                      v1::Job* reply) {
  const JobId id{request->id()};
  return change_job(context, Rpc::pause_job, id, reply,
                    [id](FarmLoop::Turn& turn) { return turn.farm.pause(id, turn.now, turn.effects); });
}

RenderServiceImpl::Unary* RenderServiceImpl::ResumeJob(Context* context, const v1::ResumeJobRequest* request,
                                                       v1::Job* reply) {
  const JobId id{request->id()};
  return change_job(context, Rpc::resume_job, id, reply,
                    [id](FarmLoop::Turn& turn) { return turn.farm.resume(id, turn.now, turn.effects); });
}

RenderServiceImpl::Unary* RenderServiceImpl::ExtendJob(Context* context, const v1::ExtendJobRequest* request,
                                                       v1::Job* reply) {
  const JobId id{request->id()};
  const Extension extension{request->samples(), request->error()};
  return change_job(context, Rpc::extend_job, id, reply, [id, extension](FarmLoop::Turn& turn) {
    return turn.farm.extend(id, extension, turn.now, turn.effects);
  });
}

RenderServiceImpl::Unary* RenderServiceImpl::SetPriority(Context* context, const v1::SetPriorityRequest* request,
                                                         v1::Job* reply) {
  const JobId id{request->id()};
  return change_job(context, Rpc::set_priority, id, reply, [id, priority = request->priority()](FarmLoop::Turn& turn) {
    return turn.farm.set_priority(id, priority, turn.now, turn.effects);
  });
}

RenderServiceImpl::Unary* RenderServiceImpl::DeleteJob(Context* context, const v1::DeleteJobRequest* request,
                                                       v1::DeleteJobResponse*) {
  const JobId id{request->id()};
  return change_job(context, Rpc::delete_job, id, nullptr, [id, cancel = request->cancel()](FarmLoop::Turn& turn) {
    return cancel ? turn.farm.discard(id, turn.now, turn.unix_ms, turn.effects)
                  : turn.farm.remove(id, turn.now, turn.effects);
  });
}

// ---- workers ----

RenderServiceImpl::Unary* RenderServiceImpl::ListWorkers(Context* context, const v1::ListWorkersRequest* request,
                                                         v1::ListWorkersResponse* reply) {
  const Result<Call> call = admit(gate_, *context, Rpc::list_workers);
  const Result<int> size = call.ok() ? page_size_of(request->page_size()) : call.status();
  if (!size.ok()) {
    return refuse(context, size.status());
  }
  reply->mutable_notices()->Add(notices_.begin(), notices_.end());
  return on_farm(context, [size = *size, after = request->page_token(), reply](FarmLoop::Turn& turn, Unary* reactor) {
    const auto most = static_cast<std::size_t>(size);
    for (const WorkerStatus& worker : turn.farm.workers(turn.now, {after, most + 1})) {
      if (reply->workers_size() == size) {
        reply->set_next_page_token(reply->workers(size - 1).name());
        break;
      }
      to_wire(worker, reply->add_workers());
    }
    reply->set_wanted_workers(turn.farm.wanted_workers(turn.now));
    reactor->Finish(grpc::Status::OK);
  });
}

RenderServiceImpl::Unary* RenderServiceImpl::DrainWorker(Context* context, const v1::DrainWorkerRequest* request,
                                                         v1::Worker* reply) {
  return run_change(loop_, gate_, context, admit(gate_, *context, Rpc::drain_worker, {0, request->name()}),
                    [name = request->name(), reply](FarmLoop::Turn& turn, const Call&, About& about) {
                      about.text = name;
                      LM_RETURN_IF_ERROR(turn.farm.drain_worker(name, turn.now, turn.effects));
                      show_worker(turn, name, reply);
                      return ok_status();
                    });
}

RenderServiceImpl::Unary* RenderServiceImpl::QuarantineWorker(Context* context,
                                                              const v1::QuarantineWorkerRequest* request,
                                                              v1::Worker* reply) {
  return run_change(loop_, gate_, context, admit(gate_, *context, Rpc::quarantine_worker, {0, request->name()}),
                    [asked = *request, reply](FarmLoop::Turn& turn, const Call& call, About& about) {
                      about.text = asked.name();
                      LM_ASSIGN_OR_RETURN(const Quarantining quarantining, from_wire(asked, call.caller));
                      LM_RETURN_IF_ERROR(turn.farm.quarantine_worker(
                          asked.name(), quarantining.reason, quarantining.render_again, turn.now, turn.effects));
                      show_worker(turn, asked.name(), reply);
                      return ok_status();
                    });
}

RenderServiceImpl::Unary* RenderServiceImpl::ReleaseWorker(Context* context, const v1::ReleaseWorkerRequest* request,
                                                           v1::ReleaseWorkerResponse*) {
  return run_change(loop_, gate_, context, admit(gate_, *context, Rpc::release_worker, {0, request->name()}),
                    [name = request->name()](FarmLoop::Turn& turn, const Call&, About& about) {
                      about.text = name;
                      return turn.farm.release_worker(name, turn.now, turn.effects);
                    });
}

}  // namespace lightmill
