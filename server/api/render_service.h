// Streams of RenderService: assets, watched jobs and whole films.
#pragma once

#include "lightmill/v1/render_service.grpc.pb.h"
#include "server/api/unary_calls.h"
#include "server/api/watch_registry.h"

namespace lightmill {

/// Thread-safe.
class RenderServiceImpl final : public UnaryCalls<v1::RenderService> {
 public:
  RenderServiceImpl(Runtime& runtime, CallResources& shared);
  /// From now on, watchers get UNAVAILABLE.
  void stop() { watches_->stop(); }

  using Context = grpc::CallbackServerContext;
  grpc::ServerReadReactor<v1::UploadAssetRequest>* UploadAsset(Context*, v1::UploadAssetResponse*) override;

 private:
  using Download = grpc::ServerBidiReactor<v1::DownloadAssetRequest, v1::DownloadAssetResponse>;
  using Watch = grpc::ServerBidiReactor<v1::WatchJobRequest, v1::WatchJobResponse>;
  using Fetch = grpc::ServerBidiReactor<v1::GetFilmRequest, v1::GetFilmResponse>;
  Download* download_asset(Context& context);
  Watch* watch_job(Context& context);
  Fetch* get_film(Context& context);

  Runtime& runtime_;
  CallResources& shared_;
  const std::shared_ptr<WatchRegistry> watches_ = std::make_shared<WatchRegistry>();
};

}  // namespace lightmill
