// Stream to a watcher or an autoscaler that sends only the newest state. A message is offered when the previous one was
// sent.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>

#include "common/base/mutex.h"
#include "server/api/grpc_access.h"
#include "server/api/grpc_status.h"
#include "server/api/watch_registry.h"
#include "server/runtime/farm_loop.h"
#include "server/runtime/runtime.h"

namespace lightmill {

/// `Sink` is the farm thread's interface to it: WatchSink or DemandSink. The farm thread calls its methods, the thread
/// that stops the server calls close(), and gRPC's threads call the On… methods.
template <class Response, class Sink>
class OfferStream : public grpc::ServerWriteReactor<Response>, public Sink, public ClosableWatch {
 public:
  OfferStream(Runtime& runtime, Call call, std::shared_ptr<WatchRegistry> registry)
      : loop_(runtime.loop()), access_(runtime.access()), call_(std::move(call)), registry_(std::move(registry)) {}

  /// Serves the stream, or ends it. `begin` runs on the farm thread.
  static grpc::ServerWriteReactor<Response>* start(const std::shared_ptr<OfferStream>& stream, FarmLoop::Task begin) {
    // The registry owns every stream until OnDone(), even if add() fails.
    Status status = stream->registry_->add(stream.get(), stream);
    if (status.ok() && !stream->loop_.post(std::move(begin))) {
      status = busy();
    }
    if (!status.ok()) {
      stream->fail(status);
    }
    return stream.get();
  }

  /// Also ends the stream if the caller's credentials have expired, or were revoked.
  bool closed() override {
    if (const Time now = system_clock().now(); now >= next_check_) {
      next_check_ = now + kCheckInterval;
      if (const Status holds = access_.check_still_holds(call_.caller); !holds.ok()) {
        fail(holds);
      }
    }
    const MutexLock lock(mutex_);
    return ending_;
  }
  bool writable() const override {
    const MutexLock lock(mutex_);
    return !writing_ && !ending_;
  }
  void fail(const Status& status) {  // also implements WatchSink::fail()
    const MutexLock lock(mutex_);
    end(to_grpc(status));
  }
  void close() override { fail(unavailable("the coordinator stops")); }

  void OnWriteDone(bool ok) override {
    call_.slot->set_active();
    {
      const MutexLock lock(mutex_);
      access_.taken(call_.peer, 0, overhead_of_sent(response_.ByteSizeLong()));
      writing_ = false;
      if (ending_) {
        this->Finish(final_status_);
        return;
      }
      if (!ok || last_) {
        end(ok ? grpc::Status::OK : to_grpc(client_left()));
        return;
      }
    }
    loop_.wake();
  }
  void OnCancel() override { fail(client_left()); }
  void OnDone() override {
    call_.slot->call_ended();
    loop_.wake();             // the hub drops closed streams
    registry_->remove(this);  // the last use of this object, except by the hub
  }

 protected:
  /// Writes a message, unless the stream ends or the caller's credentials have expired. Ends the stream after the last
  /// one.
  bool write(Response response, bool last) {
    if (const Status holds = access_.check_still_holds(call_.caller); !holds.ok()) {
      fail(holds);
      return false;
    }
    const MutexLock lock(mutex_);
    if (ending_) {
      return false;
    }
    response_.Swap(&response);
    writing_ = true;
    last_ = last;
    call_.slot->set_stalled();
    this->StartWrite(&response_);
    return true;
  }

 private:
  static Status client_left() { return make_error(StatusCode::kCancelled, "the client left"); }
  void end(const grpc::Status& status) LM_REQUIRES(mutex_) {
    if (ending_) {
      return;
    }
    ending_ = true;
    if (writing_) {
      final_status_ = status;
    } else {
      this->Finish(status);
    }
  }

  static constexpr Duration kCheckInterval = std::chrono::seconds(1);

  FarmLoop& loop_;
  const AccessControl& access_;
  const Call call_;
  const std::shared_ptr<WatchRegistry> registry_;
  Time next_check_{};  ///< used on the farm thread
  mutable Mutex mutex_;
  Response response_ LM_GUARDED_BY(mutex_);  // unchanged while writing_
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool last_ LM_GUARDED_BY(mutex_) = false;  // the message in transit is the last one
  bool ending_ LM_GUARDED_BY(mutex_) = false;
  grpc::Status final_status_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill
