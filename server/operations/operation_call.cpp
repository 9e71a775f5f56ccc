#include "server/operations/operation_call.h"

#include <utility>

namespace lightmill {

using Turn = FarmLoop::Turn;

OperationCall::OperationCall(Runtime& runtime, const Operation& operation)
    : runtime_(runtime),
      operation_(operation),
      request_(operation.handler.request->New()),
      reply_(operation.handler.reply->New()) {}

void OperationCall::start(Call call, Done done) {
  call_ = std::move(call);
  done_ = std::move(done);
  Result<Apply> apply = operation_.handler.begin(runtime_, *request_, *reply_);
  if (!apply.ok() || *apply == nullptr) {
    return finish(apply.status());
  }
  apply_ = *std::move(apply);
  if (!runtime_.loop().post([self = shared_from_this()](Turn& turn) { self->take_turn(turn); })) {
    finish(busy());
  }
}

void OperationCall::take_turn(Turn& turn) {
  if (rule_of(operation_.rpc).recorded) {
    if (const Status storing = check_store(turn); !storing.ok()) {
      return finish(storing);
    }
  }
  if (!operation_.traits.with_film) {
    return apply(turn);
  }
  turn.with_film(JobId{about().job}, [self = shared_from_this()](Turn& later, const Status& here) {
    here.ok() ? self->apply(later) : self->finish(here);
  });
}

void OperationCall::apply(Turn& turn) {
  const bool recorded = rule_of(operation_.rpc).recorded;
  About about = this->about();
  Asked asked{runtime_, turn, call_, about, *this};
  Status status =
      operation_.handler.of_job ? check_job_call(turn, runtime_.gate(), call_, JobId{about.job}) : ok_status();
  if (status.ok()) {
    status = apply_(asked);
  }
  if (recorded) {
    record(turn, runtime_.gate(), call_, about, status);
  }
  if (!status.ok()) {
    finish(status);
  } else if (recorded) {
    turn.callers.push_back([self = shared_from_this()](const Status& stored) { self->finish(stored); });
  } else if (!operation_.traits.waits) {
    finish(ok_status());
  }
  give_up(turn);  // if it was cancelled before
}

OperationCall::Done OperationCall::answer_later() {
  return [self = shared_from_this()](const Status& status) { self->finish(status); };
}

void OperationCall::cancel() {
  if (operation_.traits.waits) {
    runtime_.loop().post_always([self = shared_from_this()](Turn& turn) {
      self->cancelled_ = true;
      self->give_up(turn);
    });
  }
}

void OperationCall::give_up(Turn& turn) {
  if (cancelled_ && forget_ != nullptr) {
    std::exchange(forget_, nullptr)(turn);
    finish(make_error(StatusCode::kCancelled, "the caller is gone"));
  }
}

void OperationCall::finish(const Status& status) {
  if (const Done done = std::exchange(done_, nullptr)) {
    done(status);
  }
}

}  // namespace lightmill
