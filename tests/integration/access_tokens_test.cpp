// Tokens over real connections: stored, listed and revoked.
#include <atomic>
#include <future>
#include <set>
#include <thread>

#include "common/wire/farm_messages.h"
#include "tests/integration/secure_farm.h"
#include "tests/support/movable_clock.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

using grpc::StatusCode;

void revoke(const std::shared_ptr<grpc::Channel>& root, const std::string& token) {
  v1::RevokeTokenRequest request;
  request.set_id(token_id(token).value());
  v1::RevokeTokenResponse response;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::AccessService::NewStub(root)->RevokeToken(&context, request, &response).ok());
}

TEST(TokenAccess, TokensOutliveTheCoordinatorOnlyAsHashes) {
  SecureFarm secure;
  const auto root = [&] { return secure.channel(secure.person("root", {Role::admin})); };
  const auto listed = [&](const std::string& token) {
    return call(secure.channel(std::nullopt), "/lightmill.v1.RenderService/ListJobs", "", nullptr, token).error_code();
  };
  const std::string token = token_for(root(), "ada", {Role::submit});
  EXPECT_EQ(listed(token), StatusCode::OK);
  kill_at_once(secure.farm().server());
  secure.farm().start_server();
  EXPECT_EQ(listed(token), StatusCode::OK) << "an acknowledged job is stored";
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(secure.farm().folder())) {
    if (entry.is_regular_file()) {
      ++files;
      EXPECT_EQ(read_file(entry.path())->find(token.substr(token.rfind('_') + 1)), std::string::npos) << entry.path();
    }
  }
  EXPECT_GE(files, 2) << "the store and the log";

  v1::RevokeTokenRequest revoke;
  revoke.set_id(token_id(token).value());
  v1::RevokeTokenResponse response;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::AccessService::NewStub(root())->RevokeToken(&context, revoke, &response).ok());
  EXPECT_EQ(listed(token), StatusCode::UNAUTHENTICATED);
  kill_at_once(secure.farm().server());
  secure.farm().start_server();
  EXPECT_EQ(listed(token), StatusCode::UNAUTHENTICATED);
}

TEST(TokenAccess, TokensAreListedInPagesThatRevokingDoesNotDisturb) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const auto stub = v1::AccessService::NewStub(root);
  std::set<std::string> ids;
  for (int i = 0; i < 5; ++i) {
    ids.insert(token_id(token_for(root, "ada", {Role::view})).value());
  }
  const std::vector<std::string> sorted(ids.begin(), ids.end());
  std::vector<std::string> listed;
  v1::ListTokensRequest request;
  request.set_page_size(2);
  v1::ListTokensResponse page;
  do {
    grpc::ClientContext list;
    ASSERT_TRUE(stub->ListTokens(&list, request, &page).ok());
    for (const v1::Token& token : page.tokens()) {
      listed.push_back(token.id());
    }
    request.set_page_token(page.next_page_token());
    if (listed.size() == 2) {
      v1::RevokeTokenRequest revoke;
      revoke.set_id(listed.back());
      v1::RevokeTokenResponse revoked;
      grpc::ClientContext context;
      ASSERT_TRUE(stub->RevokeToken(&context, revoke, &revoked).ok());
    }
  } while (!page.next_page_token().empty() && listed.size() < 10);
  EXPECT_EQ(listed, sorted);
}

TEST(TokenAccess, AWorkerWithARevokedTokenIsDisconnected) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const std::string token = token_for(root, "render-1", {Role::worker});
  const BackgroundProcess worker({program("lightmill-worker"), "--server", secure.farm().address(), "--threads", "1",
                                  "--tls-ca", secure.path("ca.pem"), "--token-file", secure.write("token", token)},
                                 (secure.farm().folder() / "worker.log").string());
  const auto workers = [&] {
    grpc::ClientContext context;
    v1::ListWorkersResponse response;
    EXPECT_TRUE(v1::RenderService::NewStub(root)->ListWorkers(&context, {}, &response).ok());
    return response.workers_size();
  };
  EXPECT_TRUE(eventually([&] { return workers() == 1; })) << secure.farm().log("worker");
  revoke(root, token);
  EXPECT_TRUE(eventually([&] { return secure.farm().log("worker").find("was revoked") != std::string::npos; }))
      << secure.farm().log("worker");
  EXPECT_TRUE(eventually([&] { return workers() == 0; }));
}

TEST(TokenAccess, AnUploadWithARevokedTokenEnds) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const std::string token = token_for(root, "ada", {Role::submit});
  grpc::ClientContext upload;
  upload.AddMetadata("authorization", "Bearer " + token);
  v1::UploadAssetResponse uploaded;
  const auto stub = v1::RenderService::NewStub(secure.channel(std::nullopt));
  const auto stream = stub->UploadAsset(&upload, &uploaded);
  v1::UploadAssetRequest piece;
  const std::string half(1000, 'x');
  const Sha256 digest = sha256(half + half);
  piece.set_digest(std::string(digest.bytes.begin(), digest.bytes.end()));
  piece.set_chunk(half);
  ASSERT_TRUE(stream->Write(piece));
  ASSERT_TRUE(eventually([&] {
    const auto files = std::filesystem::recursive_directory_iterator(secure.farm().data());
    return std::any_of(begin(files), end(files),
                       [](const auto& file) { return file.is_regular_file() && file.file_size() == 1000; });
  })) << "the first half has arrived";
  revoke(root, token);
  piece.clear_digest();
  (void)stream->Write(piece);
  stream->WritesDone();
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::UNAUTHENTICATED);
}

TEST(TokenAccess, ARefusedWorkerLogsItOnceAndConnectsWhenAllowed) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const BackgroundProcess worker(
      {program("lightmill-worker"), "--server", secure.farm().address(), "--threads", "1", "--tls-ca",
       secure.path("ca.pem"), "--token-file", secure.write("token", token_for(root, "ada", {Role::submit})),
       "--log-level", "debug"},
      (secure.farm().folder() / "worker.log").string());
  const auto worker_said = [&](const std::string& words) { return secure.farm().times_said("worker", words); };
  ASSERT_TRUE(eventually([&] { return worker_said("refused by") > 0; })) << secure.farm().log("worker");
  EXPECT_NE(secure.farm().log("worker").find("pauses of up to 60 s"), std::string::npos);
  EXPECT_TRUE(eventually([&] { return worker_said("refused again") >= 2; })) << secure.farm().log("worker");
  EXPECT_EQ(worker_said("refused by"), 1) << secure.farm().log("worker");
  EXPECT_EQ(worker_said("connected to"), 0) << secure.farm().log("worker");
  EXPECT_EQ(secure.farm().times_said("server", "Work from"), 1) << secure.farm().log("server");
  secure.write("token", token_for(root, "render-1", {Role::worker}));
  EXPECT_TRUE(eventually([&] { return worker_said("connected to") == 1; })) << secure.farm().log("worker");
}

/// Sends a hello and heartbeats until the coordinator disconnects it. Returns the status.
grpc::Status work_until_sent_away(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                                  const std::string& token) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  if (!token.empty()) {
    context.AddMetadata("authorization", "Bearer " + token);
  }
  const auto stub = v1::WorkerService::NewStub(channel);
  const auto stream = stub->Work(&context);
  WorkerHello hello;
  hello.name = name;
  hello.host = "h";
  hello.fingerprint_class = "class";
  hello.renderer_version = std::string(kRendererVersion);
  v1::WorkRequest request;
  to_wire(WorkerMessage(hello), &request);
  std::atomic<bool> ended = false;
  std::thread reader([&] {  // without a reader gRPC reports the end late
    v1::WorkResponse ignored;
    while (stream->Read(&ignored)) {
    }
    ended = true;
  });
  while (!ended && stream->Write(request)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    request.Clear();
    to_wire(WorkerMessage(WorkerHeartbeat{}), &request);
  }
  reader.join();
  return stream->Finish();
}

TEST(TokenAccess, StreamsEndWithTheirCertificateOrToken) {
  constexpr std::int64_t kHour = 3600;
  const MovableClock clock;
  SecureFarm secure({}, {"127.0.0.1", {}, clock.environment()});
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const auto ends = [](const auto& stream) { return stream.wait_for(kTimeout) == std::future_status::ready; };
  const auto continues = [](const auto& stream) {
    return stream.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
  };
  const auto by_token = [&](const std::string& who, std::int64_t until) {
    return std::async(std::launch::async, [&secure, who, token = token_for(root, who, {Role::worker}, until)] {
      return work_until_sent_away(secure.channel(std::nullopt), who, token);
    });
  };
  const std::int64_t now = now_unix_s();
  auto first = by_token("render-1", now + kHour);
  auto second = std::async(std::launch::async, [&] {
    const Validity validity{now - 300, now + 3 * kHour};
    return work_until_sent_away(
        secure.channel(issue_certificate(secure.authority(), {"render-2", {}, {Role::worker}}, validity).value()), "b",
        "");
  });
  auto third = by_token("render-3", now + 5 * kHour);
  const auto workers = [&] {
    grpc::ClientContext context;
    v1::ListWorkersResponse response;
    EXPECT_TRUE(v1::RenderService::NewStub(root)->ListWorkers(&context, {}, &response).ok());
    return response.workers_size();
  };
  ASSERT_TRUE(eventually([&] { return workers() == 3; }));
  const auto expect_ended = [&](std::future<grpc::Status>& stream, const std::string& who) {
    ASSERT_TRUE(ends(stream)) << who;
    const grpc::Status status = stream.get();
    EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_NE(status.error_message().find(fmt::format("the certificate or token of '{}' expired", who)),
              std::string::npos)
        << status.error_message();
  };
  clock.move("+2h");
  expect_ended(first, "render-1");
  EXPECT_TRUE(continues(second) && continues(third)) << "not before";
  clock.move("+4h");
  expect_ended(second, "render-2");
  EXPECT_TRUE(continues(third));
  clock.move("+6h");
  expect_ended(third, "render-3");
}

TEST(TokenAccess, AScalerWithARevokedTokenIsDisconnected) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const std::string token = token_for(root, "scaler", {Role::view});
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + token);
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  const auto stub = externalscaler::ExternalScaler::NewStub(secure.channel(std::nullopt));
  const auto stream = stub->StreamIsActive(&context, {});
  externalscaler::IsActiveResponse heard;
  ASSERT_TRUE(stream->Read(&heard));
  revoke(root, token);
  EXPECT_FALSE(stream->Read(&heard)) << "nothing else happens";
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::UNAUTHENTICATED);
}

TEST(TokenAccess, AWatchWithARevokedTokenEndsWithoutAChangeOfTheJob) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  grpc::ClientContext submitting;
  upload_assets(root);
  v1::SubmitJobRequest submit;
  to_wire(job_of(Picture(), "one"), &submit);
  v1::Job job;
  ASSERT_TRUE(v1::RenderService::NewStub(root)->SubmitJob(&submitting, submit, &job).ok());
  const std::string token = token_for(root, "viewer", {Role::view});
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + token);
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  v1::WatchJobRequest watch;
  watch.set_id(job.id());
  const auto stub = v1::RenderService::NewStub(secure.channel(std::nullopt));
  const auto stream = stub->WatchJob(&context, watch);
  v1::WatchJobResponse update;
  ASSERT_TRUE(stream->Read(&update));
  revoke(root, token);
  while (stream->Read(&update)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::UNAUTHENTICATED);
}

}  // namespace
}  // namespace lightmill::test
