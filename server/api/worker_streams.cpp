#include "server/api/worker_streams.h"

#include "common/base/log.h"
#include "server/api/grpc_access.h"
#include "server/api/grpc_status.h"
#include "server/api/rejected_stream.h"
#include "server/api/work_stream.h"

namespace lightmill {
namespace {

/// All workers may reconnect before their broken streams are detected. Some that will be refused say hello first.
constexpr std::size_t kSpare = 16;

const grpc::Status kStopping(grpc::StatusCode::UNAVAILABLE, "the coordinator stops");
const grpc::Status kEvicted(grpc::StatusCode::DEADLINE_EXCEEDED,
                            "the stream sent no hello, or did not read its end, and another stream needs its slot");

}  // namespace

WorkerStreams::WorkerStreams(Runtime& runtime)
    : access_(runtime.access()),
      loop_(runtime.loop()),
      others_(runtime.options().limits.max_workers + kSpare, runtime.options().limits.max_workers + kSpare) {}
WorkerStreams::~WorkerStreams() = default;

grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* WorkerStreams::Work(grpc::CallbackServerContext* context) {
  Result<Call> call = admit(access_, *context, kWork);
  if (!call.ok()) {
    return new RejectedStream<grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>>(call.status());
  }
  std::shared_ptr<WorkStream> stream, evicted;
  grpc::Status refusal;
  {
    const MutexLock lock(mutex_);
    const SessionId session{next_session_++};
    stream = std::make_shared<WorkStream>(*this, session, std::move(*call), context);
    if (stopped_) {
      refusal = kStopping;
    } else if (!wait_for(*stream, evicted)) {
      refusal = grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                             "the farm has too many open worker streams that have sent no hello: try again later");
    }
    streams_.emplace(session, stream);
  }
  if (evicted != nullptr) {
    evicted->disconnect(kEvicted);
  }
  if (refusal.ok()) {
    stream->start();
  } else {
    stream->finish(refusal);
  }
  return stream.get();
}

bool WorkerStreams::wait_for(const WorkStream& stream, std::shared_ptr<WorkStream>& evicted) {
  const Time now = system_clock().now();
  const SlotPool::Id id = stream.session().value;
  const SlotPool::Arrival arrival = others_.acquire(id, stream.holder(), now);
  if (arrival.answer != SlotPool::Answer::acquired) {
    return false;
  }
  others_.set_stalled(id, now);
  if (arrival.evicted) {
    evicted = streams_.at(SessionId{*arrival.evicted});
  }
  return true;
}

void WorkerStreams::welcome(const WorkStream& stream, const std::string& worker, FarmLoop::TaskContext& context) {
  while (context.farm.is_full(worker)) {
    std::shared_ptr<WorkStream> evicted;
    {
      const MutexLock lock(mutex_);
      const std::optional<SlotPool::Id> id = workers_.evict_for(stream.holder());
      if (!id) {
        break;
      }
      evicted = streams_.at(SessionId{*id});
    }
    context.farm.evict_worker(evicted->session(), context.now, context.effects);
    evicted->finish(grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                                 "the farm is full (--max-workers), and makes room for a worker of another caller"));
  }
  const MutexLock lock(mutex_);
  if (streams_.contains(stream.session())) {
    others_.release(stream.session().value);
    (void)workers_.acquire(stream.session().value, stream.holder(), context.now);
  }
}

void WorkerStreams::is_leaving(WorkStream& stream) {
  std::shared_ptr<WorkStream> evicted;
  bool stays = true;
  {
    const MutexLock lock(mutex_);
    const SlotPool::Id id = stream.session().value;
    if (!streams_.contains(stream.session()) || others_.holds(id)) {
      return;
    }
    workers_.release(id);
    stays = wait_for(stream, evicted);
  }
  if (evicted != nullptr) {
    evicted->disconnect(kEvicted);
  }
  if (!stays) {
    stream.disconnect(kEvicted);
  }
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

void WorkerStreams::disconnect(SessionId session) {
  if (const std::shared_ptr<WorkStream> stream = find(session)) {
    stream->disconnect(grpc::Status(grpc::StatusCode::ABORTED, "the worker was silent for too long"));
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
    stream->finish(kStopping);
  }
}

void WorkerStreams::forget(SessionId session) {
  std::shared_ptr<WorkStream> stream;  // destroyed after the lock is released
  const MutexLock lock(mutex_);
  workers_.release(session.value);
  others_.release(session.value);
  const auto at = streams_.find(session);
  if (at != streams_.end()) {
    stream = std::move(at->second);
    streams_.erase(at);
  }
}

}  // namespace lightmill
