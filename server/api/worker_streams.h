// WorkerService: the streams of all workers. Each stream is one session. Session ids count up from 1.
#pragma once

#include <atomic>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "common/base/mutex.h"
#include "lightmill/v1/worker_service.grpc.pb.h"
#include "server/access/slot_pool.h"
#include "server/runtime/runtime.h"

namespace lightmill {

class WorkStream;

/// Thread-safe.
class WorkerStreams final : public v1::WorkerService::CallbackService {
 public:
  explicit WorkerStreams(Runtime& runtime);
  ~WorkerStreams() override;

  grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* Work(grpc::CallbackServerContext* context) override;

  /// Queues a message for the session's worker. Does nothing if the session is over.
  void send(Outgoing message);
  /// Ends the session's stream, if it is not over. The worker may connect again.
  void disconnect(SessionId session);
  /// Ends all current and future streams with UNAVAILABLE.
  void stop();

 private:
  friend class WorkStream;
  std::shared_ptr<WorkStream> find(SessionId session);
  /// Gives the stream a place among those that have not said hello. False if there is none.
  bool wait_for(const WorkStream& stream, std::shared_ptr<WorkStream>& evicted) LM_REQUIRES(mutex_);
  /// Registers the worker of a stream that has said hello. If the farm is full, workers of the callers with most
  /// workers make room. On the farm thread.
  void welcome(const WorkStream& stream, const std::string& worker, FarmLoop::TaskContext& context);
  /// The stream ends as soon as its caller has read the messages in transit.
  void is_leaving(WorkStream& stream);
  void forget(SessionId session);

  const AccessControl& access_;
  FarmLoop& loop_;
  std::atomic<std::uint64_t> bytes_in_flight_ = 0;  ///< of messages that the farm thread has not handled yet
  Mutex mutex_;
  std::map<SessionId, std::shared_ptr<WorkStream>> streams_ LM_GUARDED_BY(mutex_);
  std::uint64_t next_session_ LM_GUARDED_BY(mutex_) = 1;
  bool stopped_ LM_GUARDED_BY(mutex_) = false;
  /// Streams that have said hello. The farm limits their number.
  SlotPool workers_ LM_GUARDED_BY(mutex_){std::numeric_limits<std::size_t>::max(),
                                          std::numeric_limits<std::size_t>::max()};
  SlotPool others_ LM_GUARDED_BY(mutex_);  ///< streams that have not said hello, or are leaving
};

}  // namespace lightmill
