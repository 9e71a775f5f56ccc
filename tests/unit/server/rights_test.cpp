// Rights of callers, decided without a network. tests/integration/access_test.cpp calls all RPCs over one.
#include "server/access/rights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace lightmill {
namespace {

Identity ada(Roles roles) {
  return {"ada", roles, Proof::certificate, 0, ""};
}

TEST(Rights, SubmittersHaveOnlyTheirOwnJobs) {
  const Identity caller = ada({Role::submit});
  EXPECT_TRUE(check_job(caller, Rpc::cancel_job, "ada").ok());
  EXPECT_TRUE(may_see_job(caller, "ada"));
  EXPECT_EQ(check_job(caller, Rpc::cancel_job, "bob").code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(check_job(caller, Rpc::get_film, "bob").code(), StatusCode::kPermissionDenied);
  EXPECT_FALSE(may_see_job(caller, "bob"));
  EXPECT_FALSE(may_see_job(caller, ""));
}

TEST(Rights, ViewersSeeEverythingAndChangeNothing) {
  const Identity caller = ada({Role::view});
  EXPECT_TRUE(may_see_job(caller, "bob"));
  EXPECT_EQ(check_call(caller, Rpc::cancel_job).code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(check_call(caller, Rpc::submit_job).code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(check_job(caller, Rpc::cancel_job, "ada").code(), StatusCode::kPermissionDenied) << "not even of her name";
}

TEST(Rights, RolesAddUp) {
  const Identity caller = ada({Role::view, Role::submit});
  EXPECT_TRUE(may_see_job(caller, "bob"));
  EXPECT_TRUE(check_job(caller, Rpc::delete_job, "ada").ok());
  EXPECT_FALSE(check_job(caller, Rpc::delete_job, "bob").ok());
}

TEST(Rights, WorkersCanOnlyWorkAndTransferAssets) {
  constexpr std::array kTheirs{Rpc::work, Rpc::download_asset, Rpc::find_missing_assets, Rpc::upload_asset};
  for (const RpcRule& rule : rpc_rules()) {
    EXPECT_EQ(check_call(ada({Role::worker}), rule.rpc).ok(), std::ranges::count(kTheirs, rule.rpc) == 1)
        << rule.method;
    EXPECT_EQ(check_call(ada({Role::admin}), rule.rpc).ok(), rule.rpc != Rpc::work && rule.rpc != Rpc::enrol)
        << rule.method;
    EXPECT_FALSE(check_call(ada({}), rule.rpc).ok()) << rule.method;
    EXPECT_TRUE(check_call(anybody(), rule.rpc).ok()) << rule.method;
  }
}

TEST(Rights, RefusalsNameTheNeededRoles) {
  EXPECT_EQ(
      message_of(check_call(ada({Role::view}), Rpc::drain_worker)),
      "'ada' (roles: view; by certificate) may not drain, quarantine or release workers. Roles that may: operate, "
      "admin");
  EXPECT_EQ(message_of(check_call(ada({Role::view}), Rpc::cancel_job)),
            "'ada' (roles: view; by certificate) may not change jobs. Roles that may: submit, operate, admin")
      << "with their own jobs";
  EXPECT_EQ(message_of(check_job(ada({Role::submit}), Rpc::get_film, "bob")),
            "the job is somebody else's: 'ada' (roles: submit; by certificate) may not see jobs of others. Roles that "
            "may: view, operate, admin");
}

TEST(Rights, ListedMethodsAreThoseThatPassTheChecks) {
  for (const Role role : kRoles) {
    const Identity caller = ada({role});
    const auto any = allowed_methods(caller, false), own = allowed_methods(caller, true);
    for (const RpcRule& rule : rpc_rules()) {
      EXPECT_EQ(std::ranges::count(any, rule.method) == 1, check_job(caller, rule.rpc, "bob").ok()) << rule.method;
      EXPECT_EQ(std::ranges::count(own, rule.method) == 1, check_job(caller, rule.rpc, "ada").ok()) << rule.method;
    }
  }
}

TEST(Rights, AnRpcWithoutALineIsNotServed) {
  std::vector<std::string> methods;
  for (const RpcRule& rule : rpc_rules()) {
    methods.push_back(fmt::format("{}/{}", rule.service, rule.method));
  }
  EXPECT_TRUE(check_rules(methods).ok());
  methods.push_back("lightmill.v1.RenderService/Shutdown");
  EXPECT_NE(message_of(check_rules(methods)).find("RenderService/Shutdown is not served"), std::string::npos);
  methods.resize(methods.size() - 2);
  EXPECT_NE(message_of(check_rules(methods)).find("GetMetrics, which does not exist"), std::string::npos);
}

TEST(Identities, AWorkersNameBeginsWithItsOwner) {
  const Identity render1{"render-1", {Role::worker}, Proof::certificate, 0, ""};
  EXPECT_EQ(worker_name(render1, "render-1").value(), "render-1");
  EXPECT_EQ(worker_name(render1, "render-10").value(), "render-1/render-10");
  EXPECT_EQ(worker_name(render1, "node7-4711").value(), "render-1/node7-4711");
  EXPECT_EQ(worker_name(anybody(), "node7-4711").value(), "node7-4711");
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
