// Rights of all RPCs: of operations and of streams.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "server/operations/operation.h"
#include "server/runtime/stream_slots.h"

namespace lightmill {
namespace {

using Methods = std::vector<std::string_view>;

Identity ada(Roles roles) {
  return {"ada", roles, Proof::certificate, 0, ""};
}

/// Sorted.
Methods allowed(Roles roles) {
  Methods methods;
  for (const Rpc& rpc : served_rpcs()) {
    if (check_call(ada(roles), rpc).ok()) {
      methods.push_back(rpc.method);
    }
  }
  std::ranges::sort(methods);
  return methods;
}

TEST(OperationRights, WorkersCanOnlyWorkAndTransferAssets) {
  EXPECT_EQ(allowed({Role::worker}), (Methods{"DownloadAsset", "FindMissingAssets", "UploadAsset", "Work"}));
}

TEST(OperationRights, ABearerMayEnrolAndDoNothingElse) {
  EXPECT_EQ(allowed({Role::enrol}), Methods{"Enrol"});
}

TEST(OperationRights, AnAdministratorDoesNotRenderAndACallerWithoutRolesDoesNothing) {
  for (const Rpc& rpc : served_rpcs()) {
    EXPECT_EQ(check_call(ada({Role::admin}), rpc).ok(), rpc.method != "Work" && rpc.method != "Enrol") << rpc.method;
    EXPECT_FALSE(check_call(ada({}), rpc).ok()) << rpc.method;
    EXPECT_TRUE(check_call(anonymous_identity(), rpc).ok()) << rpc.method;
  }
}

TEST(OperationRights, ChangesAreRecorded) {
  const std::array<std::string_view, 14> changes{
      "CancelJob", "CreateToken", "DeleteJob",        "DrainWorker",   "Enrol",       "ExtendJob", "PauseJob",
      "ResumeJob", "RevokeToken", "QuarantineWorker", "ReleaseWorker", "SetPriority", "SubmitJob", "Work"};
  for (const Rpc& rpc : served_rpcs()) {
    EXPECT_EQ(rpc.recorded, std::ranges::count(changes, rpc.method) == 1) << rpc.method;
  }
  for (const Operation& operation : operations()) {
    EXPECT_EQ(operation.rpc, find_operation(operation.rpc.method)->rpc) << operation.http;
  }
}

TEST(OperationRights, ListedMethodsAreThoseThatPassTheChecks) {
  for (const Role role : kRoles) {
    const Identity caller = ada({role});
    const Methods any = allowed_methods(served_rpcs(), caller, false),
                  own = allowed_methods(served_rpcs(), caller, true);
    for (const Rpc& rpc : served_rpcs()) {
      EXPECT_EQ(std::ranges::count(any, rpc.method) == 1, check_job(caller, rpc, "bob").ok()) << rpc.method;
      EXPECT_EQ(std::ranges::count(own, rpc.method) == 1, check_job(caller, rpc, "ada").ok()) << rpc.method;
    }
  }
}

TEST(OperationRights, LongCallsHaveAKind) {
  for (const Rpc& rpc : served_rpcs()) {
    const bool lasts = rpc.method == "UploadAsset" || rpc.method == "DownloadAsset" || rpc.method == "WatchJob" ||
                       rpc.method == "GetFilm" || rpc.method == "StreamIsActive";
    EXPECT_EQ(stream_kind(rpc).has_value(), lasts) << rpc.method;
  }
}

}  // namespace
}  // namespace lightmill
