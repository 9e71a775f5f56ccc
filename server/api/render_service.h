// Streams of RenderService: assets, watched jobs and whole films.
#pragma once

#include "lightmill/v1/render_service.grpc.pb.h"
#include "server/api/unary_calls.h"
#include "server/api/watch_registry.h"

namespace lightmill {

/// Thread-safe.
class RenderServiceImpl final : public UnaryCalls<v1::RenderService> {
 public:
  RenderServiceImpl(Runtime& runtime, CallThreads& threads)
      : UnaryCalls(runtime, threads), runtime_(runtime), threads_(threads) {}
  /// From now on, watchers get UNAVAILABLE.
  void stop() { watches_->stop(); }

  using Context = grpc::CallbackServerContext;
  grpc::ServerReadReactor<v1::UploadAssetRequest>* UploadAsset(Context*, v1::UploadAssetResponse*) override;
  grpc::ServerWriteReactor<v1::DownloadAssetResponse>* DownloadAsset(Context*,
                                                                     const v1::DownloadAssetRequest*) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(Context*, const v1::WatchJobRequest*) override;
  grpc::ServerWriteReactor<v1::GetFilmResponse>* GetFilm(Context*, const v1::GetFilmRequest*) override;

 private:
  Runtime& runtime_;
  CallThreads& threads_;
  const std::shared_ptr<WatchRegistry> watches_ = std::make_shared<WatchRegistry>();
};

}  // namespace lightmill
