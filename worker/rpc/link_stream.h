// One stream of WorkerService.Work, from its opening to its end.
#pragma once

#include <deque>

#include "lightmill/v1/worker_service.grpc.pb.h"
#include "worker/rpc/farm_link.h"

namespace lightmill {

/// Who has started it waits for its end before it lets go of it: its context owns the channel, with the last of which
/// gRPC joins its own threads, so that none of them may be the one that destroys it. Operations are started under the
/// mutex, so that none is started after the end.
class LinkStream final : public grpc::ClientBidiReactor<v1::WorkRequest, v1::WorkResponse> {
 public:
  LinkStream(std::uint64_t number, std::string address, const LinkHandlers& handlers)
      : number_(number), address_(std::move(address)), handlers_(handlers) {}

  /// To be changed before start().
  grpc::ClientContext& context() { return context_; }
  void start(v1::WorkerService::Stub& stub);
  void send(std::shared_ptr<const WorkerMessage> message);
  void close();
  void cancel() { context_.TryCancel(); }
  /// Waits until gRPC has done with it.
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
  v1::WorkResponse response_;  // belongs to the read under way
  Status problem_;             // found while reading

  Mutex mutex_;
  CondVar changed_;
  v1::WorkRequest request_ LM_GUARDED_BY(mutex_);  // unchanged while writing_
  std::deque<std::shared_ptr<const WorkerMessage>> outgoing_ LM_GUARDED_BY(mutex_);
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool closing_ LM_GUARDED_BY(mutex_) = false;  // half-close after what is queued
  bool ended_ LM_GUARDED_BY(mutex_) = false;    // nothing may be started any more
  bool held_ LM_GUARDED_BY(mutex_) = true;      // gRPC waits for us
  bool done_ LM_GUARDED_BY(mutex_) = false;
};

}  // namespace lightmill
