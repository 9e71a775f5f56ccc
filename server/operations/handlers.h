// Handlers of the operations. Each reads its request, asks the farm, and writes its reply. operations.cpp has the
// table.
#pragma once

#include "externalscaler/externalscaler.pb.h"
#include "lightmill/v1/access_service.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/web.pb.h"
#include "server/operations/operation.h"

namespace lightmill::handlers {

// Submission of scenes and jobs.
Status find_missing_assets(Runtime& runtime, const v1::FindMissingAssetsRequest& request,
                           v1::FindMissingAssetsResponse* reply);
/// Limit for the files of one inspection together. A worker has them in memory beside the scenes that it renders.
inline constexpr std::uint64_t kMostInspectedBytes = std::uint64_t{512} << 20;

/// FAILED_PRECONDITION if a file is missing, RESOURCE_EXHAUSTED if they have too many bytes. Blocks on the disk.
Status check_files(const InspectionRequest& request, const AssetStore& assets);
Result<Apply> inspect_scene(Runtime& runtime, const Call& call, v1::InspectSceneRequest& request,
                            v1::InspectSceneResponse* reply);
Result<Apply> submit_job(Runtime& runtime, const Call& call, v1::SubmitJobRequest& request, v1::Job* reply);

// Jobs.
Status list_jobs(OperationContext& operation, const v1::ListJobsRequest& request, v1::ListJobsResponse* reply);
Status get_job(OperationContext& operation, const v1::GetJobRequest& request, v1::Job* reply);
Status get_spec(OperationContext& operation, const v1::GetJobRequest& request, v1::JobSpec* reply);
Status cancel_job(OperationContext& operation, const v1::CancelJobRequest& request, v1::Job* reply);
Status pause_job(OperationContext& operation, const v1::PauseJobRequest& request, v1::Job* reply);
Status resume_job(OperationContext& operation, const v1::ResumeJobRequest& request, v1::Job* reply);
Status extend_job(OperationContext& operation, const v1::ExtendJobRequest& request, v1::Job* reply);
Status set_priority(OperationContext& operation, const v1::SetPriorityRequest& request, v1::Job* reply);
Status delete_job(OperationContext& operation, const v1::DeleteJobRequest& request, v1::DeleteJobResponse* reply);

// Workers.
Status list_workers(OperationContext& operation, const v1::ListWorkersRequest& request, v1::ListWorkersResponse* reply);
Status list_all_workers(OperationContext& operation, const v1::ListWorkersRequest& request,
                        v1::ListWorkersResponse* reply);
Status drain_worker(OperationContext& operation, const v1::DrainWorkerRequest& request, v1::Worker* reply);
Status quarantine_worker(OperationContext& operation, const v1::QuarantineWorkerRequest& request, v1::Worker* reply);
Status release_worker(OperationContext& operation, const v1::ReleaseWorkerRequest& request,
                      v1::ReleaseWorkerResponse* reply);
Status release_and_show_worker(OperationContext& operation, const v1::ReleaseWorkerRequest& request, v1::Worker* reply);

// History of the farm.
Status get_history(OperationContext& operation, const v1::HistoryRequest& request, v1::FarmHistory* reply);
Status list_events(OperationContext& operation, const v1::EventsRequest& request, v1::FarmEvents* reply);
Status get_worker_history(OperationContext& operation, const v1::WorkerHistoryRequest& request,
                          v1::WorkerHistory* reply);

// Tokens, and the action log.
Status create_token(OperationContext& operation, const v1::CreateTokenRequest& request, v1::Token* reply);
Status list_tokens(OperationContext& operation, const v1::ListTokensRequest& request, v1::ListTokensResponse* reply);
Status revoke_token(OperationContext& operation, const v1::RevokeTokenRequest& request, v1::RevokeTokenResponse* reply);
Status enrol(OperationContext& operation, const v1::EnrolRequest& request, v1::Token* reply);
Status list_actions(OperationContext& operation, const v1::ListActionsRequest& request, v1::ListActionsResponse* reply);

// Autoscalers.
Status is_active(OperationContext& operation, const externalscaler::ScaledObjectRef& request,
                 externalscaler::IsActiveResponse* reply);
Status get_metric_spec(OperationContext& operation, const externalscaler::ScaledObjectRef& request,
                       externalscaler::GetMetricSpecResponse* reply);
Status get_metrics(OperationContext& operation, const externalscaler::GetMetricsRequest& request,
                   externalscaler::GetMetricsResponse* reply);

}  // namespace lightmill::handlers
