// RenderService: what clients ask. Handlers read the request, run on the farm thread, and write the reply.
#pragma once

#include <atomic>

#include "lightmill/v1/render_service.grpc.pb.h"
#include "server/runtime/runtime.h"

namespace lightmill {

/// Thread-safe.
class RenderServiceImpl final : public v1::RenderService::CallbackService {
 public:
  explicit RenderServiceImpl(Runtime& runtime)
      : assets_(runtime.assets()), gate_(runtime.gate()), notices_(runtime.options().notices), loop_(runtime.loop()) {}
  /// Watchers are told UNAVAILABLE from now on.
  void stop();

  using Context = grpc::CallbackServerContext;
  using Unary = grpc::ServerUnaryReactor;

  Unary* FindMissingAssets(Context*, const v1::FindMissingAssetsRequest*, v1::FindMissingAssetsResponse*) override;
  grpc::ServerReadReactor<v1::UploadAssetRequest>* UploadAsset(Context*, v1::UploadAssetResponse*) override;
  grpc::ServerWriteReactor<v1::DownloadAssetResponse>* DownloadAsset(Context*,
                                                                     const v1::DownloadAssetRequest*) override;

  Unary* SubmitJob(Context*, const v1::SubmitJobRequest*, v1::Job*) override;
  Unary* InspectScene(Context*, const v1::InspectSceneRequest*, v1::InspectSceneResponse*) override;
  Unary* GetJob(Context*, const v1::GetJobRequest*, v1::Job*) override;
  Unary* ListJobs(Context*, const v1::ListJobsRequest*, v1::ListJobsResponse*) override;
  Unary* CancelJob(Context*, const v1::CancelJobRequest*, v1::Job*) override;
  Unary* PauseJob(Context*, const v1::PauseJobRequest*, v1::Job*) override;
  Unary* ResumeJob(Context*, const v1::ResumeJobRequest*, v1::Job*) override;
  Unary* ExtendJob(Context*, const v1::ExtendJobRequest*, v1::Job*) override;
  Unary* SetPriority(Context*, const v1::SetPriorityRequest*, v1::Job*) override;
  Unary* DeleteJob(Context*, const v1::DeleteJobRequest*, v1::DeleteJobResponse*) override;

  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(Context*, const v1::WatchJobRequest*) override;
  grpc::ServerWriteReactor<v1::GetFilmResponse>* GetFilm(Context*, const v1::GetFilmRequest*) override;

  Unary* ListWorkers(Context*, const v1::ListWorkersRequest*, v1::ListWorkersResponse*) override;
  Unary* DrainWorker(Context*, const v1::DrainWorkerRequest*, v1::Worker*) override;
  Unary* QuarantineWorker(Context*, const v1::QuarantineWorkerRequest*, v1::Worker*) override;
  Unary* ReleaseWorker(Context*, const v1::ReleaseWorkerRequest*, v1::ReleaseWorkerResponse*) override;

 private:
  static Unary* refuse(Context* context, const Status& status);
  Unary* on_farm(Context* context, std::function<void(FarmLoop::Turn&, Unary*)> task);
  Unary* on_job(Context* context, Rpc rpc, JobId job, std::function<void(FarmLoop::Turn&, Unary*)> task);
  Unary* change_job(Context* context, Rpc rpc, JobId job, v1::Job* reply,
                    std::function<Status(FarmLoop::Turn&)> change);

  AssetStore& assets_;
  const Gate& gate_;
  const std::vector<std::string>& notices_;
  FarmLoop& loop_;
  std::shared_ptr<class WatchRegistry> watches_ = make_watch_registry();
  static std::shared_ptr<class WatchRegistry> make_watch_registry();
};

}  // namespace lightmill
