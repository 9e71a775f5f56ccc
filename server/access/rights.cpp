#include "server/access/rights.h"

#include <algorithm>

namespace lightmill {
namespace {

struct Permission {
  std::string_view what;  ///< as in "may not submit jobs"
  Roles roles;            ///< they may do this with any job
};

constexpr Permission permission_for(Right right) {
  switch (right) {
    case Right::submit:
      return {"submit jobs", {Role::submit, Role::operate, Role::admin}};
    case Right::upload_assets:
      return {"upload assets", {Role::worker, Role::submit, Role::operate, Role::admin}};
    case Right::see_job:
      return {"see jobs", {Role::view, Role::operate, Role::admin}};
    case Right::control_job:
      return {"change jobs", {Role::operate, Role::admin}};
    case Right::see_farm:
      return {"see the farm", {Role::view, Role::submit, Role::operate, Role::admin}};
    case Right::control_farm:
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
  if (right == Right::see_job || right == Right::control_job) {
    roles.add(Role::submit);
  }
  return roles;
}

bool may(const Identity& caller, Right right, std::string_view owner) {
  const bool own = !caller.name.empty() && caller.name == owner;
  return caller.roles.has_any(own ? roles_for_own(right) : permission_for(right).roles);
}

}  // namespace

Status check_call(const Identity& caller, const Rpc& rpc) {
  const Right right = rpc.right;
  return caller.roles.has_any(roles_for_own(right))
             ? ok_status()
             : make_error(StatusCode::kPermissionDenied, "{} may not {}. Roles that may: {}", describe(caller),
                          permission_for(right).what, names_of(roles_for_own(right)));
}

Status check_job(const Identity& caller, const Rpc& rpc, std::string_view owner) {
  const Right right = rpc.right;
  return may(caller, right, owner)
             ? ok_status()
             : make_error(StatusCode::kPermissionDenied,
                          "the job belongs to another user: {} may not {} of others. Roles that may: {}",
                          describe(caller), permission_for(right).what, names_of(permission_for(right).roles));
}

bool may_see_job(const Identity& caller, std::string_view owner) {
  return may(caller, Right::see_job, owner);
}

std::vector<std::string_view> allowed_methods(std::span<const Rpc> rpcs, const Identity& caller, bool own) {
  std::vector<std::string_view> methods;
  for (const Rpc& rpc : rpcs) {
    if (caller.roles.has_any(own ? roles_for_own(rpc.right) : permission_for(rpc.right).roles)) {
      methods.push_back(rpc.method);
    }
  }
  return methods;
}

Status check_rpcs(std::span<const Rpc> rpcs, std::span<const std::string> methods) {
  std::vector<std::string> known;
  for (const Rpc& rpc : rpcs) {
    known.push_back(fmt::format("{}/{}", rpc.service, rpc.method));
  }
  for (const std::string& method : methods) {
    if (std::ranges::find(known, method) == known.end()) {
      return internal_error("{} is not served: no operation or stream says who may call it", method);
    }
  }
  for (const std::string& name : known) {
    if (std::ranges::find(methods, name) == methods.end()) {
      return internal_error("an operation or stream names {}, which does not exist", name);
    }
  }
  return ok_status();
}

}  // namespace lightmill
