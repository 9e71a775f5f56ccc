// Rights of callers, decided without a network. operation_rights_test.cpp has those of each RPC.
// tests/integration/access_test.cpp calls all RPCs over a network.
#include "server/access/rights.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr Rpc kCancelJob{kRenderService, "CancelJob", Right::control_job, true};
constexpr Rpc kSubmitJob{kRenderService, "SubmitJob", Right::submit, true};
constexpr Rpc kDrainWorker{kRenderService, "DrainWorker", Right::control_farm, true};

Identity ada(Roles roles) {
  return {"ada", roles, Proof::certificate, 0, ""};
}

TEST(Rights, SubmittersHaveOnlyTheirOwnJobs) {
  const Identity caller = ada({Role::submit});
  EXPECT_TRUE(check_job(caller, kCancelJob, "ada").ok());
  EXPECT_TRUE(may_see_job(caller, "ada"));
  EXPECT_EQ(check_job(caller, kCancelJob, "bob").code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(check_job(caller, kGetFilm, "bob").code(), StatusCode::kPermissionDenied);
  EXPECT_FALSE(may_see_job(caller, "bob"));
  EXPECT_FALSE(may_see_job(caller, ""));
}

TEST(Rights, ViewersSeeEverythingAndChangeNothing) {
  const Identity caller = ada({Role::view});
  EXPECT_TRUE(may_see_job(caller, "bob"));
  EXPECT_EQ(check_call(caller, kCancelJob).code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(check_call(caller, kSubmitJob).code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(check_job(caller, kCancelJob, "ada").code(), StatusCode::kPermissionDenied) << "not even of her name";
}

TEST(Rights, RolesAddUp) {
  const Identity caller = ada({Role::view, Role::submit});
  EXPECT_TRUE(may_see_job(caller, "bob"));
  EXPECT_TRUE(check_job(caller, kCancelJob, "ada").ok());
  EXPECT_FALSE(check_job(caller, kCancelJob, "bob").ok());
}

TEST(Rights, RefusalsNameTheNeededRoles) {
  EXPECT_EQ(
      message_of(check_call(ada({Role::view}), kDrainWorker)),
      "'ada' (roles: view; by certificate) may not drain, quarantine or release workers. Roles that may: operate, "
      "admin");
  EXPECT_EQ(message_of(check_call(ada({Role::view}), kCancelJob)),
            "'ada' (roles: view; by certificate) may not change jobs. Roles that may: submit, operate, admin")
      << "with their own jobs";
  EXPECT_EQ(
      message_of(check_job(ada({Role::submit}), kGetFilm, "bob")),
      "the job belongs to another user: 'ada' (roles: submit; by certificate) may not see jobs of others. Roles that "
      "may: view, operate, admin");
}

TEST(Rights, AnRpcWithoutAnEntryIsNotServed) {
  std::vector<std::string> methods;
  for (const Rpc& rpc : kStreams) {
    methods.push_back(fmt::format("{}/{}", rpc.service, rpc.method));
  }
  EXPECT_TRUE(check_rpcs(kStreams, methods).ok());
  methods.push_back("lightmill.v1.RenderService/Shutdown");
  EXPECT_NE(message_of(check_rpcs(kStreams, methods)).find("RenderService/Shutdown is not served"), std::string::npos);
  methods.resize(methods.size() - 2);
  EXPECT_NE(message_of(check_rpcs(kStreams, methods)).find("StreamIsActive, which does not exist"), std::string::npos);
}

TEST(Identities, AWorkersNameBeginsWithItsOwner) {
  const Identity render1{"render-1", {Role::worker}, Proof::certificate, 0, ""};
  EXPECT_EQ(worker_name(render1, "render-1").value(), "render-1");
  EXPECT_EQ(worker_name(render1, "render-10").value(), "render-1/render-10");
  EXPECT_EQ(worker_name(render1, "node7-4711").value(), "render-1/node7-4711");
  EXPECT_EQ(worker_name(anonymous_identity(), "node7-4711").value(), "node7-4711");
  const Identity render{"render", {Role::worker}, Proof::certificate, 0, ""};
  const Identity enrolled{"render/node7", {Role::worker}, Proof::token, 0, ""};
  EXPECT_EQ(worker_name(enrolled, "4711").value(), "render/node7/4711");
  EXPECT_EQ(worker_name(render, "node7").value(), "render/node7");
  for (const auto& [other, said] : {std::pair(render, "node7/4711"), std::pair(enrolled, "render/node7")}) {
    EXPECT_EQ(worker_name(other, said).status().code(), StatusCode::kInvalidArgument) << "it is another's name";
  }
  EXPECT_EQ(worker_name(render1, std::string(200, 'x')).status().code(), StatusCode::kInvalidArgument);
}

TEST(Identities, ComeFromCertificates) {
  CertificateFacts facts;
  facts.name = "ada";
  facts.roles = {Role::submit};
  facts.until_unix_s = 1000;
  const auto identity = identity_of(facts, 999);
  ASSERT_TRUE(identity.ok()) << identity.status();
  EXPECT_EQ(identity->name, "ada");
  EXPECT_TRUE(check_still_holds(*identity, 999).ok());
  EXPECT_EQ(check_still_holds(*identity, 1000).code(), StatusCode::kUnauthenticated);
  EXPECT_EQ(identity_of(facts, 1000).status().code(), StatusCode::kUnauthenticated);
  facts.roles = {};
  EXPECT_EQ(identity_of(facts, 999).status().code(), StatusCode::kUnauthenticated);
  facts.roles = {Role::admin};
  for (const std::string& name : {std::string(), std::string("a\nb"), std::string("a\0b", 3), std::string("\xff")}) {
    facts.name = name;
    EXPECT_EQ(identity_of(facts, 999).status().code(), StatusCode::kUnauthenticated);
  }
}

}  // namespace
}  // namespace lightmill
