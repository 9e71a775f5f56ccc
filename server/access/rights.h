// Rights of callers: which roles may call a method, and on whose jobs.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/ids.h"
#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

/// Kind of permission that a call needs.
enum class Right {
  submit,         ///< submit jobs
  upload_assets,  ///< upload assets with jobs, or found in scene files by workers
  see_job,        ///< read a job and its film
  control_job,    ///< change a job's state, goal or priority
  see_farm,       ///< read the state of the farm
  control_farm,   ///< change the state of workers
  fetch_assets,   ///< read the assets of jobs
  work,           ///< render
  administer,     ///< manage tokens and read the log
  enrol           ///< get a worker's token
};

/// Method of gRPC, and who may call it. server/operations has those of operations; streams are below.
struct Rpc {
  std::string_view service, method;
  Right right = Right::administer;
  bool recorded = false;  ///< it changes something, so the action log records it
  friend bool operator==(const Rpc&, const Rpc&) = default;
};

inline constexpr std::string_view kRenderService = "lightmill.v1.RenderService";
inline constexpr std::string_view kWorkerService = "lightmill.v1.WorkerService";
inline constexpr std::string_view kAccessService = "lightmill.v1.AccessService";
inline constexpr std::string_view kScalerService = "externalscaler.ExternalScaler";

inline constexpr Rpc kUploadAsset{kRenderService, "UploadAsset", Right::upload_assets};
inline constexpr Rpc kDownloadAsset{kRenderService, "DownloadAsset", Right::fetch_assets};
inline constexpr Rpc kWatchJob{kRenderService, "WatchJob", Right::see_job};
inline constexpr Rpc kGetFilm{kRenderService, "GetFilm", Right::see_job};
inline constexpr Rpc kWork{kWorkerService, "Work", Right::work, true};
inline constexpr Rpc kStreamIsActive{kScalerService, "StreamIsActive", Right::see_farm};
inline constexpr std::array kStreams{kUploadAsset, kDownloadAsset, kWatchJob, kGetFilm, kWork, kStreamIsActive};

class StreamSlot;

/// A call that was admitted, or is to be checked.
struct Call {
  Identity caller;
  Rpc rpc;
  std::string peer;                            ///< ADDRESS:PORT
  std::shared_ptr<StreamSlot> slot = nullptr;  ///< for a call that lasts (StreamKind)
  /// For SubmitJob: receives the id of a job that ends with its page. Empty: the job does not end with a page.
  std::function<void(JobId)> on_submitted = nullptr;
};

/// Whether the caller may make this call at all. check_job() checks the job. PERMISSION_DENIED names the roles that
/// may.
Status check_call(const Identity& caller, const Rpc& rpc);

/// Whether the caller may make this call for a job of `owner`. PERMISSION_DENIED.
Status check_job(const Identity& caller, const Rpc& rpc, std::string_view owner);

/// Whether the caller may read a job of `owner`.
bool may_see_job(const Identity& caller, std::string_view owner);

/// The methods that the caller may call, for its own jobs (`own`) or for all jobs.
std::vector<std::string_view> allowed_methods(std::span<const Rpc> rpcs, const Identity& caller, bool own);

/// INTERNAL unless `rpcs` has exactly `methods`, the methods of the registered services ("SERVICE/METHOD").
Status check_rpcs(std::span<const Rpc> rpcs, std::span<const std::string> methods);

}  // namespace lightmill
