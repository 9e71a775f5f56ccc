// Table of RPCs: which roles may call them, and on whose jobs. An RPC without a line is not served.
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

enum class Rpc {
  find_missing_assets,
  upload_asset,
  download_asset,
  submit_job,
  inspect_scene,
  get_job,
  list_jobs,
  cancel_job,
  pause_job,
  resume_job,
  extend_job,
  set_priority,
  delete_job,
  watch_job,
  get_film,
  list_workers,
  drain_worker,
  quarantine_worker,
  release_worker,
  work,
  create_token,
  list_tokens,
  revoke_token,
  enrol,
  list_actions,
  is_active,
  stream_is_active,
  get_metric_spec,
  get_metrics,
  count
};

/// Kind of permission that a call needs.
enum class Right {
  submit,        ///< submit jobs
  bring_assets,  ///< upload assets with jobs, or found in scene files by workers
  see_job,       ///< read a job and its film
  steer_job,     ///< change a job's state, goal or priority
  see_farm,      ///< read the state of the farm
  steer_farm,    ///< change the state of workers
  fetch_assets,  ///< read the assets of jobs
  work,          ///< render
  administer,    ///< manage tokens and read the log
  enrol          ///< get a worker's token
};

struct RpcRule {
  Rpc rpc;
  std::string_view service, method;
  Right right;
  bool recorded;  ///< it changes something, so the farm's log records it
};

class StreamSlot;

/// A call that was admitted, or is to be checked.
struct Call {
  Identity caller;
  Rpc rpc = Rpc::count;
  std::string peer;                            ///< ADDRESS:PORT
  std::shared_ptr<StreamSlot> slot = nullptr;  ///< for a call that lasts (StreamKind)
  /// For SubmitJob: receives the id of a job that ends with its page. Empty: the job does not end with a page.
  std::function<void(JobId)> on_submitted = nullptr;
};

/// In the order of Rpc.
std::span<const RpcRule> rpc_rules();
const RpcRule& rule_of(Rpc rpc);

/// Whether the caller may make this call at all. check_job() checks the job. PERMISSION_DENIED names the roles that
/// may.
Status check_call(const Identity& caller, Rpc rpc);

/// Whether the caller may make this call for a job of `owner`. PERMISSION_DENIED.
Status check_job(const Identity& caller, Rpc rpc, std::string_view owner);

/// Whether the caller may read a job of `owner`.
bool may_see_job(const Identity& caller, std::string_view owner);

/// The methods of all RPCs that the caller may call, for its own jobs (`own`) or for all jobs.
std::vector<std::string_view> allowed_methods(const Identity& caller, bool own);

/// `methods` are all served methods, "SERVICE/METHOD". INTERNAL unless each has a line in the table, and each line a
/// method.
Status check_rules(std::span<const std::string> methods);

}  // namespace lightmill
