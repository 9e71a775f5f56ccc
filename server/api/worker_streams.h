// WorkerService: one bidirectional stream per worker, its messages handed to the farm thread and back.
#pragma once

#include <atomic>
#include <map>
#include <memory>

#include "common/base/mutex.h"
#include "lightmill/v1/worker_service.grpc.pb.h"
#include "server/api/farm_loop.h"
#include "server/api/gate.h"

namespace lightmill {

class WorkStream;

/// Thread-safe. Each stream is one session; session ids count up from 1.
class WorkerStreams final : public v1::WorkerService::CallbackService {
 public:
  explicit WorkerStreams(const Gate& gate);
  ~WorkerStreams() override;
  /// Where events go; before the server starts. Streams beyond `max_streams` are refused with RESOURCE_EXHAUSTED, and
  /// so are those of one caller beyond half of that which have not said hello.
  void set_loop(FarmLoop& loop, std::size_t max_streams) {
    loop_ = &loop;
    max_streams_ = max_streams;
  }

  grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* Work(grpc::CallbackServerContext* context) override;

  /// Queues a message for a session's worker; nothing happens if the session is over.
  void send(Outgoing message);
  /// Ends a session's stream, if it is not over; the worker may come again.
  void hang_up(SessionId session);
  /// Ends all streams, and new ones at once, with UNAVAILABLE.
  void stop();

 private:
  friend class WorkStream;
  std::shared_ptr<WorkStream> find(SessionId session);
  /// Of one more stream of the caller; OK: it is taken. `silent`: those to be ended, which make room for later ones.
  grpc::Status refusal_of(const std::string& caller, std::vector<std::shared_ptr<WorkStream>>& silent)
      LM_REQUIRES(mutex_);
  void forget(SessionId session);

  const Gate& gate_;
  FarmLoop* loop_ = nullptr;
  std::size_t max_streams_ = 0;
  std::atomic<std::uint64_t> bytes_in_flight_ = 0;  ///< of messages that the farm thread has not yet seen
  Mutex mutex_;
  std::map<SessionId, std::shared_ptr<WorkStream>> streams_ LM_GUARDED_BY(mutex_);
  std::uint64_t next_session_ LM_GUARDED_BY(mutex_) = 1;
  bool stopped_ LM_GUARDED_BY(mutex_) = false;
  /// Streams that have said no hello, by caller: counted again when places are short.
  std::map<std::string, std::size_t> strangers_ LM_GUARDED_BY(mutex_);
  Time counted_at_ LM_GUARDED_BY(mutex_){};
};

}  // namespace lightmill
