#include "worker/rpc/link_stream.h"

#include "common/base/log.h"
#include "common/wire/farm_messages.h"

namespace lightmill {

void LinkStream::start(v1::WorkerService::Stub& stub) {
  stub.async()->Work(&context_, this);
  AddHold();  // writes start outside gRPC's callbacks
  StartRead(&response_);
  StartCall();
}

void LinkStream::send(std::shared_ptr<const WorkerMessage> message) {
  const MutexLock lock(mutex_);
  if (ended_ || closing_) {
    return;
  }
  outgoing_.push_back(std::move(message));
  if (!writing_) {
    write_next();
  }
}

void LinkStream::close() {
  const MutexLock lock(mutex_);
  if (ended_ || closing_) {
    return;
  }
  closing_ = true;
  if (!writing_) {
    StartWritesDone();
  }
}

void LinkStream::wait() {
  const MutexLock lock(mutex_);
  while (!done_) {
    changed_.wait(mutex_);
  }
}

void LinkStream::write_next() {
  writing_ = true;
  request_.Clear();
  to_wire(*outgoing_.front(), &request_);
  outgoing_.pop_front();
  StartWrite(&request_);
}

/// Reading has ended, so the stream is over. Lets gRPC finish it after a write in progress.
void LinkStream::end() {
  bool release = false;
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    outgoing_.clear();
    release = held_ && !writing_;
    held_ = held_ && !release;
  }
  if (release) {
    RemoveHold();
  }
}

void LinkStream::OnReadInitialMetadataDone(bool ok) {
  if (ok) {
    handlers_.connected(number_, address_);
  }
}

void LinkStream::OnReadDone(bool ok) {
  if (!ok) {
    end();
    return;
  }
  Result<CoordinatorMessage> message = from_wire(response_);
  if (!message.ok()) {
    problem_ = with_context(message.status(), "the coordinator's message");
    context_.TryCancel();
    end();
    return;
  }
  handlers_.message(number_, std::move(*message));
  StartRead(&response_);
}

void LinkStream::OnWriteDone(bool ok) {
  bool ended = false;
  {
    const MutexLock lock(mutex_);
    writing_ = false;
    ended = ended_;
    if (ok && !ended) {
      if (!outgoing_.empty()) {
        write_next();
      } else if (closing_) {
        StartWritesDone();
      }
    }
  }
  if (ended) {
    end();
  }
}

void LinkStream::OnDone(const grpc::Status& status) {
  const Status reason = !problem_.ok()
                            ? problem_
                            : make_error(static_cast<StatusCode>(status.error_code()), "{}", status.error_message());
  handlers_.disconnected(number_, address_, reason);
  const MutexLock lock(mutex_);
  done_ = true;
  changed_.notify_all();
}

}  // namespace lightmill
