// RenderService's streams: assets, and films as they grow or whole.
#pragma once

#include "lightmill/v1/render_service.grpc.pb.h"
#include "server/api/unary_calls.h"

namespace lightmill {

/// Thread-safe.
class RenderServiceImpl final : public UnaryCalls<v1::RenderService> {
 public:
  explicit RenderServiceImpl(Runtime& runtime)
      : UnaryCalls(runtime), assets_(runtime.assets()), gate_(runtime.gate()), loop_(runtime.loop()) {}
  /// Watchers are told UNAVAILABLE from now on.
  void stop();

  using Context = grpc::CallbackServerContext;
  grpc::ServerReadReactor<v1::UploadAssetRequest>* UploadAsset(Context*, v1::UploadAssetResponse*) override;
  grpc::ServerWriteReactor<v1::DownloadAssetResponse>* DownloadAsset(Context*,
                                                                     const v1::DownloadAssetRequest*) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(Context*, const v1::WatchJobRequest*) override;
  grpc::ServerWriteReactor<v1::GetFilmResponse>* GetFilm(Context*, const v1::GetFilmRequest*) override;

 private:
  AssetStore& assets_;
  const Gate& gate_;
  FarmLoop& loop_;
  std::shared_ptr<class WatchRegistry> watches_ = make_watch_registry();
  static std::shared_ptr<class WatchRegistry> make_watch_registry();
};

}  // namespace lightmill
