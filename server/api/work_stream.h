// Stream of one worker: passes its messages to the farm thread, and the farm's messages to the worker.
#pragma once

#include <atomic>
#include <map>
#include <memory>

#include "common/base/mutex.h"
#include "lightmill/v1/worker_service.grpc.pb.h"
#include "server/access/slot_pool.h"
#include "server/runtime/access_control.h"
#include "server/runtime/farm_loop.h"
#include "server/runtime/outgoing_queue.h"

namespace lightmill {

class WorkerStreams;

/// Any thread may call send, finish and disconnect. gRPC's threads call the On… methods.
///
/// Reads, writes and the end start under the mutex, so nothing starts after the end. Starting one never calls back into
/// this object. The end waits for a write in progress.
class WorkStream final : public grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>,
                         public std::enable_shared_from_this<WorkStream> {
 public:
  WorkStream(WorkerStreams& owner, SessionId session, Call call, grpc::CallbackServerContext* context)
      : owner_(owner), session_(session), call_(std::move(call)), context_(context) {}

  SessionId session() const { return session_; }
  Holder holder() const { return holder_of(call_.caller, call_.peer); }

  /// Answers the call, so the worker knows that it is connected. Starts to read.
  void start();
  void send(CoordinatorMessage message);
  /// Ends the stream at once, even if the worker does not read.
  void disconnect(const grpc::Status& status);
  void finish(const grpc::Status& status);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override { finish(grpc::Status(grpc::StatusCode::CANCELLED, "the stream broke")); }
  void OnDone() override;

 private:
  void write(const CoordinatorMessage& message) LM_REQUIRES(mutex_);
  /// Starts a read, unless one is in progress or the farm thread has too many messages.
  void read_on() LM_REQUIRES(mutex_);
  void end(const grpc::Status& status) LM_REQUIRES(mutex_);
  /// Logs sent messages, for people who follow a unit.
  void trace(const CoordinatorMessage& message) LM_REQUIRES(mutex_);
  void trace(const WorkerResult& result);
  /// On the farm thread.
  void deliver(WorkerMessage message, FarmLoop::TaskContext& context);

  WorkerStreams& owner_;
  const SessionId session_;
  const Call call_;
  grpc::CallbackServerContext* const context_;  // owned by gRPC, valid until OnDone has returned
  v1::WorkRequest request_;                     // used by the read in progress
  std::atomic<bool> greeted_ = false;           // set by reads

  Mutex mutex_;
  bool reading_ LM_GUARDED_BY(mutex_) = false;
  int in_flight_ LM_GUARDED_BY(mutex_) = 0;          // read, but not yet handled by the farm thread
  v1::WorkResponse response_ LM_GUARDED_BY(mutex_);  // unchanged while writing_
  OutgoingQueue outgoing_ LM_GUARDED_BY(mutex_);     // empty unless writing_
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool dismissed_ LM_GUARDED_BY(mutex_) = false;  // the message in transit is the last one
  bool ending_ LM_GUARDED_BY(mutex_) = false;
  bool done_ LM_GUARDED_BY(mutex_) = false;
  grpc::Status final_status_ LM_GUARDED_BY(mutex_);
  /// Not committed yet. Filled only if traces().
  std::map<NodeKey, std::pair<Hash128, LeaseId>> results_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill
