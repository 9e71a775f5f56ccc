#include "server/api/worker_streams.h"

#include "common/base/log.h"
#include "common/base/quantities.h"
#include "common/wire/farm_messages.h"
#include "server/api/grpc_status.h"
#include "server/api/recorded_calls.h"
#include "server/api/refused.h"

namespace lightmill {
namespace {

/// Messages of one worker that the farm thread has not yet seen; reading pauses beyond. One, while those of all workers
/// hold more than so many bytes: the others wait where they are, and no farm is too large for the memory.
constexpr int kWindow = 16;
constexpr std::uint64_t kWindowBytes = std::uint64_t{128} << 20;
/// Messages that a worker has not yet read; its stream is ended beyond.
constexpr std::size_t kMaxOutgoing = 4'096;

/// A stream that has not said hello for so long makes room for another where there is none.
constexpr Duration kHelloPatience = std::chrono::seconds(10);
constexpr Duration kRoomPause = std::chrono::milliseconds(100);

/// Two acknowledgements that wait make one.
bool join_acks(std::deque<CoordinatorMessage>& queue, CoordinatorMessage& message) {
  auto* ack = std::get_if<ResultAck>(&message);
  auto* last = queue.empty() ? nullptr : std::get_if<ResultAck>(&queue.back());
  if (ack == nullptr || last == nullptr || last->keys.size() > 10'000) {
    return false;
  }
  last->keys.insert(last->keys.end(), ack->keys.begin(), ack->keys.end());
  return true;
}

/// "job 1, samples [0, 16)", of a unit or a node.
std::string text_of(JobId job, const SampleRange& range) {
  return fmt::format("job {}, samples [{}, {})", job.value, range.first(), range.end());
}

bool traces() {
  return spdlog::should_log(spdlog::level::debug);
}

/// A result must be what its worker hashed.
Status check_hash(const WorkerMessage& message) {
  const auto* result = std::get_if<WorkerResult>(&message);
  if (result == nullptr) {
    return ok_status();
  }
  const Hash128 actual = hash_of(result->node);
  return actual == result->hash ? ok_status()
                                : data_loss("a result of job {} arrived damaged: hash {} instead of {}",
                                            result->key.job.value, actual.hex(), result->hash.hex());
}

}  // namespace

/// One worker's stream; send and finish come from any thread, the On… methods from gRPC's.
///
/// Reads, writes and the end are started under the mutex (starting one never calls back into this object), so that
/// nothing is started after the end. The end waits for a write under way.
class WorkStream final : public grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>,
                         public std::enable_shared_from_this<WorkStream> {
 public:
  WorkStream(WorkerStreams& owner, SessionId session, Call call, grpc::CallbackServerContext* context)
      : owner_(owner), session_(session), call_(std::move(call)), context_(context) {}

  /// Answers the call, so that the worker knows that it is connected, and reads.
  void start() {
    const MutexLock lock(mutex_);
    if (!ending_) {
      StartSendInitialMetadata();
      read_on();
    }
  }

  /// Whose place it takes, as long as it has not said hello.
  std::string caller() const { return caller_key(call_.caller, call_.peer); }
  bool greeted() const { return greeted_; }
  bool is_silent(Time now) const { return !greeted_ && now - opened_ >= kHelloPatience; }

  void send(CoordinatorMessage message) {
    if (const auto* const dismissal = std::get_if<Dismissal>(&message); dismissal != nullptr && dismissal->for_now) {
      return finish(grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, dismissal->reason));
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
      if (!join_acks(outgoing_, message)) {
        outgoing_.push_back(std::move(message));
      }
      if (outgoing_.size() <= kMaxOutgoing) {
        return;
      }
    }
    spdlog::warn("session {}: the worker does not read its messages; its stream is ended", session_.value);
    hang_up(grpc::Status(grpc::StatusCode::ABORTED, "the worker does not read its messages"));
  }

  /// Also where nobody listens any more.
  void hang_up(const grpc::Status& status) {
    const MutexLock lock(mutex_);
    end(status);
    if (!done_) {
      context_->TryCancel();
    }
  }

  void finish(const grpc::Status& status) {
    const MutexLock lock(mutex_);
    end(status);
  }

  void OnReadDone(bool ok) override {
    if (!ok) {
      finish(grpc::Status::OK);
      return;
    }
    if (const Status holds = owner_.gate_.check_still_holds(call_.caller); !holds.ok()) {
      finish(to_grpc(holds));
      return;
    }
    const std::uint64_t bytes = request_.ByteSizeLong();
    owner_.loop_->traffic().results_in += bytes;
    Result<WorkerMessage> message = from_wire(request_);
    Status status = message.status();
    if (status.ok()) {
      status = check_hash(*message);
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
    owner_.loop_->post_always(
        [self = shared_from_this(), body = std::move(*message), bytes](FarmLoop::Turn& turn) mutable {
          if (self->owner_.bytes_in_flight_ >= kWindowBytes) {
            turn.farm.cannot_keep_up(turn.now);
          }
          self->deliver(std::move(body), turn);
          self->owner_.bytes_in_flight_ -= bytes;
          const MutexLock lock(self->mutex_);
          --self->in_flight_;
          self->read_on();
        });
    const MutexLock lock(mutex_);
    reading_ = false;
    read_on();
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(mutex_);
    writing_ = false;
    if (ending_) {
      Finish(final_status_);
    } else if (!ok || dismissed_) {
      end(grpc::Status::OK);
    } else if (!outgoing_.empty()) {
      const CoordinatorMessage message = std::move(outgoing_.front());
      outgoing_.pop_front();
      write(message);
    }
  }

  void OnCancel() override { finish(grpc::Status(grpc::StatusCode::CANCELLED, "the stream broke")); }

  void OnDone() override {
    {
      const MutexLock lock(mutex_);
      done_ = true;
    }
    if (greeted_) {
      owner_.loop_->post_always([session = session_](FarmLoop::Turn& turn) {
        turn.farm.worker_disconnected(session, turn.now, turn.effects);
      });
    }
    owner_.forget(session_);  // the last use of this object
  }

 private:
  void write(const CoordinatorMessage& message) LM_REQUIRES(mutex_) {
    writing_ = true;
    dismissed_ = std::holds_alternative<Dismissal>(message);
    response_.Clear();
    to_wire(message, &response_);
    StartWrite(&response_);
  }

  /// Starts a read, unless one is under way or the farm thread has enough to do.
  void read_on() LM_REQUIRES(mutex_) {
    const int window = owner_.bytes_in_flight_ < kWindowBytes ? kWindow : 1;
    if (!ending_ && !reading_ && in_flight_ < window) {
      reading_ = true;
      StartRead(&request_);
    }
  }

  void end(const grpc::Status& status) LM_REQUIRES(mutex_) {
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

  /// What is sent, as far as somebody may want to follow a unit.
  void trace(const CoordinatorMessage& message) LM_REQUIRES(mutex_) {
    if (const auto* const grant = std::get_if<LeaseGrant>(&message)) {
      const LogTrace about(grant->trace, grant->lease.value);
      spdlog::debug("session {}: lease {} is granted: {}, {}", session_.value, grant->lease.value,
                    text_of(grant->unit.job, grant->unit.range), counted(grant->unit.tiles.size(), "tile"));
    } else if (const auto* const ack = std::get_if<ResultAck>(&message)) {
      for (const NodeKey& key : ack->keys) {
        if (const auto traced = results_.extract(key)) {
          const auto& [trace, lease] = traced.mapped();
          const LogTrace about(trace, lease.value);
          spdlog::debug("session {}: lease {}: {}, tile {} is committed", session_.value, lease.value,
                        text_of(key.job, key.range), key.tile.value);
        }
      }
    }
  }

  void trace(const WorkerResult& result) {
    {
      const MutexLock lock(mutex_);
      results_[result.key] = {result.trace, result.lease};
    }
    const LogTrace about(result.trace, result.lease.value);
    spdlog::debug("session {}: lease {}: {}, tile {} is here", session_.value, result.lease.value,
                  text_of(result.key.job, result.key.range), result.key.tile.value);
  }

  /// On the farm thread.
  void deliver(WorkerMessage message, FarmLoop::Turn& turn) {
    if (const auto* hello = std::get_if<WorkerHello>(&message)) {
      spdlog::debug("session {}: worker {} from {}", session_.value, hello->name, call_.peer);
      record(turn, owner_.gate_, call_, {0, hello->name}, ok_status());
      turn.farm.worker_connected(session_, *hello, turn.now, turn.effects);
    } else {
      if (const auto* const result = std::get_if<WorkerResult>(&message); result != nullptr && traces()) {
        trace(*result);
      }
      turn.farm.worker_message(session_, std::move(message), turn.now, turn.unix_ms, turn.effects);
    }
  }

  WorkerStreams& owner_;
  const SessionId session_;
  const Call call_;
  grpc::CallbackServerContext* const context_;  // gRPC's; there until OnDone has returned
  v1::WorkRequest request_;                     // belongs to the read under way
  std::atomic<bool> greeted_ = false;           // set by reads
  const Time opened_ = system_clock().now();

  Mutex mutex_;
  bool reading_ LM_GUARDED_BY(mutex_) = false;
  int in_flight_ LM_GUARDED_BY(mutex_) = 0;                        // read, and not yet seen by the farm thread
  v1::WorkResponse response_ LM_GUARDED_BY(mutex_);                // unchanged while writing_
  std::deque<CoordinatorMessage> outgoing_ LM_GUARDED_BY(mutex_);  // empty unless writing_
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool dismissed_ LM_GUARDED_BY(mutex_) = false;  // what is being written is the last message
  bool ending_ LM_GUARDED_BY(mutex_) = false;
  bool done_ LM_GUARDED_BY(mutex_) = false;
  grpc::Status final_status_ LM_GUARDED_BY(mutex_);
  /// Not committed yet; only while traces().
  std::map<NodeKey, std::pair<Hash128, LeaseId>> results_ LM_GUARDED_BY(mutex_);
};

WorkerStreams::WorkerStreams(const Gate& gate) : gate_(gate) {}
WorkerStreams::~WorkerStreams() = default;

grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* WorkerStreams::Work(grpc::CallbackServerContext* context) {
  Result<Call> call = admit(gate_, *context, Rpc::work);
  if (!call.ok()) {
    return new Refused<grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>>(call.status());
  }
  std::shared_ptr<WorkStream> stream;
  std::vector<std::shared_ptr<WorkStream>> silent;
  grpc::Status refusal;
  {
    const MutexLock lock(mutex_);
    const SessionId session{next_session_++};
    stream = std::make_shared<WorkStream>(*this, session, std::move(*call), context);
    refusal = refusal_of(stream->caller(), silent);
    streams_.emplace(session, stream);
  }
  for (const std::shared_ptr<WorkStream>& each : silent) {
    each->hang_up(grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "the stream said no hello"));
  }
  if (refusal.ok()) {
    stream->start();
  } else {
    stream->finish(refusal);
  }
  return stream.get();
}

grpc::Status WorkerStreams::refusal_of(const std::string& caller, std::vector<std::shared_ptr<WorkStream>>& silent) {
  if (stopped_) {
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator stops");
  }
  if (2 * streams_.size() < max_streams_) {
    return grpc::Status::OK;
  }
  const Time now = system_clock().now();
  if (now - counted_at_ >= kRoomPause) {
    counted_at_ = now;
    strangers_.clear();
    for (const auto& [session, each] : streams_) {
      if (each->is_silent(now)) {
        silent.push_back(each);
      } else if (!each->greeted()) {
        ++strangers_[each->caller()];
      }
    }
  }
  if (streams_.size() >= max_streams_) {
    return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                        fmt::format("the farm has all of its {} worker streams open: try again later", max_streams_));
  }
  if (++strangers_[caller] > max_streams_ / 2) {
    return grpc::Status(
        grpc::StatusCode::RESOURCE_EXHAUSTED,
        fmt::format("the farm takes {} worker streams of one caller that have not said hello: try again later",
                    max_streams_ / 2));
  }
  return grpc::Status::OK;
}

std::shared_ptr<WorkStream> WorkerStreams::find(SessionId session) {
  const MutexLock lock(mutex_);
  const auto at = streams_.find(session);
  return at == streams_.end() ? nullptr : at->second;
}

void WorkerStreams::send(Outgoing message) {
  if (const std::shared_ptr<WorkStream> stream = find(message.to)) {
    stream->send(std::move(message.message));
  }
}

void WorkerStreams::hang_up(SessionId session) {
  if (const std::shared_ptr<WorkStream> stream = find(session)) {
    stream->hang_up(grpc::Status(grpc::StatusCode::ABORTED, "nothing was heard of the worker for too long"));
  }
}

void WorkerStreams::stop() {
  std::vector<std::shared_ptr<WorkStream>> streams;
  {
    const MutexLock lock(mutex_);
    stopped_ = true;
    for (const auto& [session, stream] : streams_) {
      streams.push_back(stream);
    }
  }
  for (const std::shared_ptr<WorkStream>& stream : streams) {
    stream->finish(grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator stops"));
  }
}

void WorkerStreams::forget(SessionId session) {
  std::shared_ptr<WorkStream> stream;  // destroyed after the lock is released
  const MutexLock lock(mutex_);
  const auto at = streams_.find(session);
  if (at != streams_.end()) {
    stream = std::move(at->second);
    streams_.erase(at);
  }
}

}  // namespace lightmill
