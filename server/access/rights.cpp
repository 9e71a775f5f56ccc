#include "server/access/rights.h"

#include <algorithm>

namespace lightmill {
namespace {

constexpr std::string_view kRender = "lightmill.v1.RenderService";
constexpr std::string_view kWork = "lightmill.v1.WorkerService";
constexpr std::string_view kAccess = "lightmill.v1.AccessService";
constexpr std::string_view kScaler = "externalscaler.ExternalScaler";

constexpr std::array<RpcRule, static_cast<std::size_t>(Rpc::count)> kRules{{
    {Rpc::find_missing_assets, kRender, "FindMissingAssets", Right::bring_assets, false},
    {Rpc::upload_asset, kRender, "UploadAsset", Right::bring_assets, false},
    {Rpc::download_asset, kRender, "DownloadAsset", Right::fetch_assets, false},
    {Rpc::submit_job, kRender, "SubmitJob", Right::submit, true},
    {Rpc::inspect_scene, kRender, "InspectScene", Right::submit, false},
    {Rpc::get_job, kRender, "GetJob", Right::see_job, false},
    {Rpc::list_jobs, kRender, "ListJobs", Right::see_farm, false},
    {Rpc::cancel_job, kRender, "CancelJob", Right::steer_job, true},
    {Rpc::pause_job, kRender, "PauseJob", Right::steer_job, true},
    {Rpc::resume_job, kRender, "ResumeJob", Right::steer_job, true},
    {Rpc::extend_job, kRender, "ExtendJob", Right::steer_job, true},
    {Rpc::set_priority, kRender, "SetPriority", Right::steer_job, true},
    {Rpc::delete_job, kRender, "DeleteJob", Right::steer_job, true},
    {Rpc::watch_job, kRender, "WatchJob", Right::see_job, false},
    {Rpc::get_film, kRender, "GetFilm", Right::see_job, false},
    {Rpc::list_workers, kRender, "ListWorkers", Right::see_farm, false},
    {Rpc::drain_worker, kRender, "DrainWorker", Right::steer_farm, true},
    {Rpc::quarantine_worker, kRender, "QuarantineWorker", Right::steer_farm, true},
    {Rpc::release_worker, kRender, "ReleaseWorker", Right::steer_farm, true},
    {Rpc::work, kWork, "Work", Right::work, true},
    {Rpc::create_token, kAccess, "CreateToken", Right::administer, true},
    {Rpc::list_tokens, kAccess, "ListTokens", Right::administer, false},
    {Rpc::revoke_token, kAccess, "RevokeToken", Right::administer, true},
    {Rpc::enrol, kAccess, "Enrol", Right::enrol, true},
    {Rpc::list_actions, kAccess, "ListActions", Right::administer, false},
    {Rpc::is_active, kScaler, "IsActive", Right::see_farm, false},
    {Rpc::stream_is_active, kScaler, "StreamIsActive", Right::see_farm, false},
    {Rpc::get_metric_spec, kScaler, "GetMetricSpec", Right::see_farm, false},
    {Rpc::get_metrics, kScaler, "GetMetrics", Right::see_farm, false},
}};

consteval bool in_order() {
  for (std::size_t i = 0; i < kRules.size(); ++i) {
    if (static_cast<std::size_t>(kRules[i].rpc) != i || kRules[i].method.empty()) {
      return false;
    }
  }
  return true;
}
static_assert(in_order(), "every Rpc has its line, in the order of the enumeration");

struct Permission {
  std::string_view what;  ///< as in "may not submit jobs"
  Roles roles;            ///< they may do this with any job
};

constexpr Permission permission_for(Right right) {
  switch (right) {
    case Right::submit:
      return {"submit jobs", {Role::submit, Role::operate, Role::admin}};
    case Right::bring_assets:
      return {"upload assets", {Role::worker, Role::submit, Role::operate, Role::admin}};
    case Right::see_job:
      return {"see jobs", {Role::view, Role::operate, Role::admin}};
    case Right::steer_job:
      return {"change jobs", {Role::operate, Role::admin}};
    case Right::see_farm:
      return {"see the farm", {Role::view, Role::submit, Role::operate, Role::admin}};
    case Right::steer_farm:
      return {"drain, quarantine or release workers", {Role::operate, Role::admin}};
    case Right::fetch_assets:
      return {"read assets", {Role::worker, Role::operate, Role::admin}};
    case Right::work:
      return {"render", {Role::worker}};
    case Right::administer:
      return {"manage tokens or read the log", {Role::admin}};
    case Right::enrol:
      return {"enrol", {Role::enrol}};
  }
  return {};
}

/// Roles that may do this with their own jobs.
constexpr Roles roles_for_own(Right right) {
  Roles roles = permission_for(right).roles;
  if (right == Right::see_job || right == Right::steer_job) {
    roles.add(Role::submit);
  }
  return roles;
}

bool may(const Identity& caller, Right right, std::string_view owner) {
  const bool own = !caller.name.empty() && caller.name == owner;
  return caller.roles.has_any(own ? roles_for_own(right) : permission_for(right).roles);
}

}  // namespace

std::span<const RpcRule> rpc_rules() {
  return kRules;
}

const RpcRule& rule_of(Rpc rpc) {
  return kRules.at(static_cast<std::size_t>(rpc));
}

Status check_call(const Identity& caller, Rpc rpc) {
  const Right right = rule_of(rpc).right;
  return caller.roles.has_any(roles_for_own(right))
             ? ok_status()
             : make_error(StatusCode::kPermissionDenied, "{} may not {}. Roles that may: {}", describe(caller),
                          permission_for(right).what, names_of(roles_for_own(right)));
}

Status check_job(const Identity& caller, Rpc rpc, std::string_view owner) {
  const Right right = rule_of(rpc).right;
  return may(caller, right, owner)
             ? ok_status()
             : make_error(StatusCode::kPermissionDenied,
                          "the job is somebody else's: {} may not {} of others. Roles that may: {}", describe(caller),
                          permission_for(right).what, names_of(permission_for(right).roles));
}

bool may_see_job(const Identity& caller, std::string_view owner) {
  return may(caller, Right::see_job, owner);
}

std::vector<std::string_view> allowed_methods(const Identity& caller, bool own) {
  std::vector<std::string_view> methods;
  for (const RpcRule& rule : kRules) {
    if (caller.roles.has_any(own ? roles_for_own(rule.right) : permission_for(rule.right).roles)) {
      methods.push_back(rule.method);
    }
  }
  return methods;
}

Status check_rules(std::span<const std::string> methods) {
  std::vector<std::string> named;
  for (const RpcRule& rule : kRules) {
    named.push_back(fmt::format("{}/{}", rule.service, rule.method));
  }
  for (const std::string& method : methods) {
    if (std::ranges::find(named, method) == named.end()) {
      return internal_error("{} is not served: server/access/rights.cpp does not say who may call it", method);
    }
  }
  for (const std::string& name : named) {
    if (std::ranges::find(methods, name) == methods.end()) {
      return internal_error("server/access/rights.cpp names {}, which does not exist", name);
    }
  }
  return ok_status();
}

}  // namespace lightmill
