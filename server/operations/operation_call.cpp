#include "server/operations/operation_call.h"

#include <utility>

#include "server/operations/changes.h"
#include "server/runtime/action_records.h"

namespace lightmill {

using TaskContext = FarmLoop::TaskContext;

namespace {

/// RESOURCE_EXHAUSTED while the farm can store nothing, because the call would wait.
Status check_store(const TaskContext& context) {
  return context.no_store.empty()
             ? ok_status()
             : resource_exhausted("the farm cannot store anything now, so nothing is changed: {}. Try again later",
                                  context.no_store);
}

}  // namespace

OperationCall::OperationCall(Runtime& runtime, const Operation& operation)
    : runtime_(runtime),
      operation_(operation),
      request_(operation.handler.request->New()),
      reply_(operation.handler.reply->New()) {}

void OperationCall::start(Call call, Done done) {
  call_ = std::move(call);
  done_ = std::move(done);
  const std::uint64_t bytes = request_->ByteSizeLong();  // the first step may free them
  Result<Apply> apply = operation_.handler.begin(runtime_, call_, *request_, *reply_);
  if (!apply.ok() || *apply == nullptr) {
    return finish(apply.status());
  }
  apply_ = *std::move(apply);
  if (!runtime_.loop().post([self = shared_from_this()](TaskContext& context) { self->run(context); }, bytes)) {
    finish(busy());
  }
}

void OperationCall::run(TaskContext& context) {
  if (operation_.rpc.recorded) {
    if (const Status storing = check_store(context); !storing.ok()) {
      return finish(storing);
    }
  }
  if (!operation_.traits.with_film) {
    return apply(context);
  }
  context.with_film(JobId{about().job}, [self = shared_from_this()](TaskContext& later, const Status& here) {
    here.ok() ? self->apply(later) : self->finish(here);
  });
}

void OperationCall::apply(TaskContext& context) {
  const bool recorded = operation_.rpc.recorded;
  CallSubject about = this->about();
  OperationContext arguments{runtime_, context, call_, about, *this};
  Status status =
      operation_.handler.of_job ? check_job_call(context, runtime_.access(), call_, JobId{about.job}) : ok_status();
  if (status.ok()) {
    status = recorded && operation_.handler.of_job ? change_job(arguments) : apply_(arguments);
  }
  if (arguments.entries > 0) {
    runtime_.access().charge_entries(call_, arguments.entries);
  }
  if (recorded) {
    record(context, runtime_.access(), call_, about, status);
  }
  if (!status.ok()) {
    finish(status);
  } else if (recorded) {
    context.callers.push_back([self = shared_from_this()](const Status& stored) { self->finish(stored); });
  } else if (!operation_.traits.waits) {
    finish(ok_status());
  }
  give_up(context);  // if it was cancelled before
}

/// Notes for the action log what the operation changes.
Status OperationCall::change_job(OperationContext& operation) const {
  const TaskContext& context = operation.context;
  const JobId job{operation.about.job};
  LM_ASSIGN_OR_RETURN(const JobStatus before, context.farm.decided_status(job, context.now));
  LM_RETURN_IF_ERROR(apply_(operation));
  const Result<JobStatus> after = context.farm.decided_status(job, context.now);
  operation.about.text = before.spec.name;
  operation.about.change = describe_change(before, after.ok() ? &*after : nullptr);
  return ok_status();
}

OperationCall::Done OperationCall::answer_later() {
  return [self = shared_from_this()](const Status& status) { self->finish(status); };
}

void OperationCall::cancel() {
  if (operation_.traits.waits) {
    runtime_.loop().post_always([self = shared_from_this()](TaskContext& context) {
      self->cancelled_ = true;
      self->give_up(context);
    });
  }
}

void OperationCall::give_up(TaskContext& context) {
  if (cancelled_ && forget_ != nullptr) {
    std::exchange(forget_, nullptr)(context);
    finish(make_error(StatusCode::kCancelled, "the caller is gone"));
  }
}

void OperationCall::finish(const Status& status) {
  if (const Done done = std::exchange(done_, nullptr)) {
    done(status);
  }
}

}  // namespace lightmill
