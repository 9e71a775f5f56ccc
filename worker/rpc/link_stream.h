// One stream of WorkerService.Work, from start to end.
#pragma once

#include <deque>

#include "lightmill/v1/worker_service.grpc.pb.h"
#include "worker/rpc/coordinator_link.h"

namespace lightmill {

/// The owner waits for the stream's end before it releases the stream. The stream's context owns the channel. The last
/// owner of a channel joins gRPC's threads, so none of them may destroy it. Operations start under the mutex, so
/// nothing starts after the end.
class LinkStream final : public grpc::ClientBidiReactor<v1::WorkRequest, v1::WorkResponse> {
 public:
  LinkStream(std::uint64_t number, std::string address, const LinkHandlers& handlers)
      : number_(number), address_(std::move(address)), handlers_(handlers) {}

  /// Change it only before start().
  grpc::ClientContext& context() { return context_; }
  void start(v1::WorkerService::Stub& stub);
  void send(std::shared_ptr<const WorkerMessage> message);
  void close();
  void cancel() { context_.TryCancel(); }
  /// Waits until gRPC is done with the stream.
  void wait();

  void OnReadInitialMetadataDone(bool ok) override;
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

 private:
  void write_next() LM_REQUIRES(mutex_);
  void end();

  const std::uint64_t number_;
  const std::string address_;
  const LinkHandlers handlers_;
  grpc::ClientContext context_;
  v1::WorkResponse response_;  // used by the read in progress
  Status problem_;             // found while reading

  Mutex mutex_;
  CondVar changed_;
  v1::WorkRequest request_ LM_GUARDED_BY(mutex_);  // unchanged while writing_
  std::deque<std::shared_ptr<const WorkerMessage>> outgoing_ LM_GUARDED_BY(mutex_);
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool closing_ LM_GUARDED_BY(mutex_) = false;  // half-close after the queued messages
  bool ended_ LM_GUARDED_BY(mutex_) = false;    // nothing may start any more
  bool held_ LM_GUARDED_BY(mutex_) = true;      // gRPC waits for our RemoveHold()
  bool done_ LM_GUARDED_BY(mutex_) = false;
};

}  // namespace lightmill
