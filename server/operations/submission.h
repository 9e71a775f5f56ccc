// A job on its way in, whichever way it comes: what SubmitJob asks for and looks into, off the farm thread and on it.
#pragma once

#include "common/farm/job.h"
#include "server/runtime/records.h"
#include "server/store/asset_store.h"

namespace lightmill::v1 {
class FindMissingAssetsRequest;
class FindMissingAssetsResponse;
class SubmitJobRequest;
}  // namespace lightmill::v1

namespace lightmill {

/// Those of the digests that the store does not have. Looks at the disk. INVALID_ARGUMENT.
Status find_missing(const AssetStore& assets, const v1::FindMissingAssetsRequest& request,
                    v1::FindMissingAssetsResponse* reply);

/// What the files of one inspection may have together: a worker holds them beside the scenes that it renders.
inline constexpr std::uint64_t kMostInspectedBytes = std::uint64_t{512} << 20;

/// FAILED_PRECONDITION if a file is missing, RESOURCE_EXHAUSTED if they have too many bytes. Looks at the disk.
Status check_files(const InspectionRequest& request, const AssetStore& assets);

/// Ready for the farm.
struct Submission {
  JobSpec spec;
  MethodNotes notes;
};

/// Reads the request and settles the method. Takes its time: the scene is looked into, and the disk. INVALID_ARGUMENT,
/// FAILED_PRECONDITION if an asset is missing.
Result<Submission> read_submission(const v1::SubmitJobRequest& request, const AssetStore& assets);

/// Queues the job as the caller's; `about` says which it is. Errors as Coordinator::submit has them, and ALREADY_EXISTS
/// if the request id is that of somebody else's.
Status submit(FarmLoop::Turn& turn, const Call& call, Submission& submission, About& about);

}  // namespace lightmill
