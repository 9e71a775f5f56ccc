// Which roles may call which RPC, on whose jobs: one table, without a line in which an RPC is not served.
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

/// What a call is about.
enum class Right {
  submit,        ///< bring jobs
  bring_assets,  ///< with jobs, or as what workers find in scene files
  see_job,       ///< look at a job and its film
  steer_job,     ///< change what becomes of a job
  see_farm,      ///< know what the farm is doing
  steer_farm,    ///< change what workers do
  fetch_assets,  ///< read the assets of jobs
  work,          ///< render
  administer,    ///< say who gets in
  enrol          ///< be given a token as a worker
};

struct RpcRule {
  Rpc rpc;
  std::string_view service, method;
  Right right;
  bool recorded;  ///< it changes something: the farm's log says who did so
};

class StreamPlace;

/// A call that was let in, or is to be.
struct Call {
  Identity caller;
  Rpc rpc = Rpc::count;
  std::string peer;                              ///< ADDRESS:PORT
  std::shared_ptr<StreamPlace> place = nullptr;  ///< of a call that lasts (StreamKind)
  /// Of SubmitJob: told of the job, which ends with a page; empty: it does not.
  std::function<void(JobId)> tell_page = nullptr;
};

/// In the order of Rpc.
std::span<const RpcRule> rpc_rules();
const RpcRule& rule_of(Rpc rpc);

/// Whether the caller may make such a call at all; which jobs it may name is asked below. PERMISSION_DENIED says which
/// roles would do.
Status check_call(const Identity& caller, Rpc rpc);

/// Whether the caller may do so with a job of `owner`. PERMISSION_DENIED.
Status check_job(const Identity& caller, Rpc rpc, std::string_view owner);

/// The same as a word.
bool may_see_job(const Identity& caller, std::string_view owner);

/// The methods of all RPCs that the caller may call: with jobs of their own, or with anybody's.
std::vector<std::string_view> allowed_methods(const Identity& caller, bool own);

/// `methods` are all that are to be served, "SERVICE/METHOD": INTERNAL unless each has its line, and each line its
/// method.
Status check_rules(std::span<const std::string> methods);

}  // namespace lightmill
