#include "server/api/work_stream.h"

#include "common/base/log.h"
#include "common/base/number_text.h"
#include "common/wire/farm_messages.h"
#include "server/api/grpc_status.h"
#include "server/api/worker_streams.h"
#include "server/listen/unread_bytes.h"
#include "server/runtime/action_records.h"

namespace lightmill {
namespace {

/// Messages of one worker that the farm thread has not handled yet. Beyond this, reading pauses. The limit is one while
/// all workers' messages exceed kWindowBytes, which bounds the memory for any size of the farm.
constexpr int kWindow = 16;
constexpr std::uint64_t kWindowBytes = std::uint64_t{128} << 20;

bool traces() {
  return spdlog::should_log(spdlog::level::debug);
}

}  // namespace

void WorkStream::start() {
  const MutexLock lock(mutex_);
  if (!ending_) {
    StartSendInitialMetadata();
    read_on();
  }
}

void WorkStream::send(CoordinatorMessage message) {
  if (const auto* const dismissal = std::get_if<Dismissal>(&message)) {
    if (dismissal->for_now) {
      return finish(grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, dismissal->reason));
    }
    owner_.is_leaving(*this);
  }
  {
    const MutexLock lock(mutex_);
    if (ending_) {
      return;
    }
    if (traces()) {
      trace(message);
    }
    if (!writing_) {
      write(message);
      return;
    }
    outgoing_.push(std::move(message));
    if (!outgoing_.is_full()) {
      return;
    }
  }
  spdlog::warn("session {} ({}): closed the stream, because the worker does not read its messages. It may reconnect",
               session_.value, call_.peer);
  disconnect(grpc::Status(grpc::StatusCode::ABORTED, "the worker does not read its messages"));
}

void WorkStream::disconnect(const grpc::Status& status) {
  const MutexLock lock(mutex_);
  end(status);
  if (!done_) {
    context_->TryCancel();
  }
}

void WorkStream::finish(const grpc::Status& status) {
  bool waits = false;
  {
    const MutexLock lock(mutex_);
    end(status);
    waits = writing_;
  }
  if (waits) {
    owner_.is_leaving(*this);
  }
}

void WorkStream::OnReadDone(bool ok) {
  if (!ok) {
    finish(grpc::Status::OK);
    return;
  }
  const std::uint64_t bytes = request_.ByteSizeLong();
  owner_.access_.taken(call_.peer, bytes, UnreadBytes::kMessageOverhead);
  if (const Status holds = owner_.access_.check_still_holds(call_.caller); !holds.ok()) {
    finish(to_grpc(holds));
    return;
  }
  owner_.loop_.traffic().results_in += bytes;
  Result<WorkerMessage> message = from_wire(request_);
  Status status = message.status();
  if (auto* const result = status.ok() ? std::get_if<WorkerResult>(&*message) : nullptr) {
    result->damaged = !has_its_hash(*result);
  }
  if (status.ok() && std::holds_alternative<WorkerHello>(*message) == greeted_) {
    status = greeted_ ? invalid_argument("a second hello on one stream")
                      : invalid_argument("the first message must be a hello");
  }
  if (auto* const hello = status.ok() ? std::get_if<WorkerHello>(&*message) : nullptr) {
    const Result<std::string> name = worker_name(call_.caller, hello->name);
    status = name.status();
    hello->name = name.value_or("");
    hello->identity = call_.caller.name;
  }
  if (!status.ok()) {
    spdlog::warn("session {} ({}): {}", session_.value, call_.peer, message_of(status));
    finish(to_grpc(status));
    return;
  }
  greeted_ = true;
  owner_.bytes_in_flight_ += bytes;
  {
    const MutexLock lock(mutex_);
    ++in_flight_;
  }
  owner_.loop_.post_always(
      [self = shared_from_this(), body = std::move(*message), bytes](FarmLoop::TaskContext& context) mutable {
        if (self->owner_.bytes_in_flight_ >= kWindowBytes) {
          context.farm.note_backlog(context.now);
        }
        self->deliver(std::move(body), context);
        self->owner_.bytes_in_flight_ -= bytes;
        const MutexLock lock(self->mutex_);
        --self->in_flight_;
        self->read_on();
      });
  const MutexLock lock(mutex_);
  reading_ = false;
  read_on();
}

void WorkStream::OnWriteDone(bool ok) {
  const MutexLock lock(mutex_);
  writing_ = false;
  if (ending_) {
    Finish(final_status_);
  } else if (!ok || dismissed_) {
    end(grpc::Status::OK);
  } else if (!outgoing_.empty()) {
    write(outgoing_.pop());
  }
}

void WorkStream::OnDone() {
  {
    const MutexLock lock(mutex_);
    done_ = true;
  }
  if (greeted_) {
    owner_.loop_.post_always([session = session_](FarmLoop::TaskContext& context) {
      context.farm.worker_disconnected(session, context.now, context.effects);
    });
  }
  owner_.forget(session_);  // the last use of this object
}

void WorkStream::write(const CoordinatorMessage& message) {
  writing_ = true;
  dismissed_ = std::holds_alternative<Dismissal>(message);
  response_.Clear();
  to_wire(message, &response_);
  StartWrite(&response_);
}

void WorkStream::read_on() {
  const int window = owner_.bytes_in_flight_ < kWindowBytes ? kWindow : 1;
  if (!ending_ && !reading_ && in_flight_ < window) {
    reading_ = true;
    StartRead(&request_);
  }
}

void WorkStream::end(const grpc::Status& status) {
  if (ending_) {
    return;
  }
  ending_ = true;
  outgoing_.clear();
  if (writing_) {
    final_status_ = status;
  } else {
    Finish(status);
  }
}

void WorkStream::trace(const CoordinatorMessage& message) {
  if (const auto* const grant = std::get_if<LeaseGrant>(&message)) {
    const LogTrace about(grant->trace, grant->lease.value);
    spdlog::debug("session {}: lease {} is granted: {}, {}", session_.value, grant->lease.value,
                  describe(grant->unit.job, grant->unit.range), counted(grant->unit.tiles.size(), "tile"));
  } else if (const auto* const ack = std::get_if<ResultAck>(&message)) {
    for (const NodeKey& key : ack->keys) {
      if (const auto traced = results_.extract(key)) {
        const auto& [trace, lease] = traced.mapped();
        const LogTrace about(trace, lease.value);
        spdlog::debug("session {}: lease {}: {} is committed", session_.value, lease.value, describe(key));
      }
    }
  }
}

void WorkStream::trace(const WorkerResult& result) {
  {
    const MutexLock lock(mutex_);
    results_[result.key] = {result.trace, result.lease};
  }
  const LogTrace about(result.trace, result.lease.value);
  spdlog::debug("session {}: lease {}: {} is here", session_.value, result.lease.value, describe(result.key));
}

void WorkStream::deliver(WorkerMessage message, FarmLoop::TaskContext& context) {
  if (const auto* hello = std::get_if<WorkerHello>(&message)) {
    spdlog::debug("session {}: worker {} from {}", session_.value, hello->name, call_.peer);
    record(context, owner_.access_, call_,
           {.text = hello->name,
            .change = fmt::format("connected: {} on {}", counted(hello->threads, "thread"), hello->host)},
           ok_status());
    owner_.welcome(*this, hello->name, context);
    context.farm.worker_connected(session_, *hello, context.now, context.effects);
  } else {
    if (const auto* const result = std::get_if<WorkerResult>(&message); result != nullptr && traces()) {
      trace(*result);
    }
    context.farm.worker_message(session_, std::move(message), context.now, context.unix_ms, context.effects);
  }
}

}  // namespace lightmill
