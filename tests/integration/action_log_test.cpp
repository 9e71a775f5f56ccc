// The action log over real connections: changing RPCs are recorded, others are not, and acknowledged entries outlive
// the coordinator.
#include <csignal>
#include <regex>

#include "common/wire/farm_messages.h"
#include "tests/integration/secure_farm.h"

namespace lightmill::test {
namespace {

using grpc::StatusCode;

/// Texts of the entries of change_everything(), by RPC. RPCs with an empty text
/// change nothing, and are not recorded, as in docs/operate/security.md. This is a second copy, written by hand.
const std::map<std::string, std::string>& changes() {
  static const std::map<std::string, std::string> all{
      {"FindMissingAssets", ""},
      {"UploadAsset", ""},
      {"DownloadAsset", ""},
      {"SubmitJob", "cornell-bench-blocks: submitted: 84 samples per pixel, priority 0"},
      {"InspectScene", ""},
      {"GetJob", ""},
      {"ListJobs", ""},
      {"CancelJob", "cornell-bench-blocks: state queued -> cancelled"},
      {"PauseJob", "cornell-bench-blocks: state queued -> paused"},
      {"ResumeJob", "cornell-bench-blocks: state paused -> queued"},
      {"ExtendJob", "cornell-bench-blocks: samples 84 -> 1000"},
      {"SetPriority", "cornell-bench-blocks: priority 0 -> 3"},
      {"DeleteJob", "cornell-bench-blocks: state cancelled -> deleted"},
      {"WatchJob", ""},
      {"GetFilm", ""},
      {"ListWorkers", ""},
      {"DrainWorker", "render-1/w1: draining no -> yes"},
      {"QuarantineWorker", "render-1/w1: quarantine none -> 'put there by root: smells of smoke'"},
      {"ReleaseWorker", "render-1/w1: quarantine 'put there by root: smells of smoke' -> none"},
      {"Work", "render-1/w1: connected: 3 threads on h1"},
      {"CreateToken", "ID for carl: created: roles view, valid for 30 days"},
      {"ListTokens", ""},
      {"RevokeToken", "ID of carl: revoked: roles view"},
      {"Enrol", "ID for render/node7: created: roles worker, valid for 24 hours, use 1 of 1"},
      {"ListActions", ""},
      {"IsActive", ""},
      {"StreamIsActive", ""},
      {"GetMetricSpec", ""},
      {"GetMetrics", ""},
  };
  return all;
}

/// "ABOUT: CHANGE", without what is new in each run.
std::string change_of(const v1::Action& action) {
  return std::regex_replace(action.about(), std::regex("^[0-9a-f]{12} "), "ID ") + ": " + action.change();
}

std::vector<v1::Action> actions(const std::shared_ptr<grpc::Channel>& admin, v1::ListActionsRequest request = {}) {
  std::vector<v1::Action> all;
  const auto stub = v1::AccessService::NewStub(admin);
  request.set_page_size(3);
  for (;;) {
    grpc::ClientContext context;
    v1::ListActionsResponse page;
    const grpc::Status status = stub->ListActions(&context, request, &page);
    EXPECT_TRUE(status.ok()) << status.error_message();
    all.insert(all.begin(), page.actions().rbegin(), page.actions().rend());  // oldest first
    if (page.next_page_token().empty()) {
      return all;
    }
    request.set_page_token(page.next_page_token());
  }
}

std::string line(const v1::Action& action) {
  return fmt::format("{}{} job {} {} {}", action.caller().empty() ? "-" : action.caller(),
                     action.proof() == v1::PROOF_CERTIFICATE ? " by certificate"
                     : action.proof() == v1::PROOF_TOKEN     ? " by token"
                                                             : "",
                     action.job(), action.operation(), action.code() == 0 ? "done" : "refused");
}

std::vector<std::string> lines(const std::vector<v1::Action>& actions) {
  std::vector<std::string> all;
  for (const v1::Action& action : actions) {
    all.push_back(line(action));
  }
  return all;
}

template <class Stub, class Request, class Reply>
Reply done(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Reply*),
           const Request& request) {
  grpc::ClientContext context;
  Reply reply;
  const grpc::Status status = (stub.*method)(&context, request, &reply);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return reply;
}

template <class Request>
Request of_job(std::uint64_t job) {
  Request request;
  request.set_id(job);
  return request;
}

/// Calls each changing RPC once with success, using root's certificate.
void change_everything(const std::shared_ptr<grpc::Channel>& root, const std::shared_ptr<grpc::Channel>& machine) {
  using Render = v1::RenderService::Stub;
  const auto render = v1::RenderService::NewStub(root);
  const auto access = v1::AccessService::NewStub(root);
  upload_assets(root);
  const std::string token = token_id(token_for(root, "carl", {Role::view}, now_unix_s() + 30 * kDay)).value();
  v1::SubmitJobRequest submit;
  to_wire(job_of(Picture(), "one"), &submit);
  const std::uint64_t job = done(*render, &Render::SubmitJob, submit).id();
  done(*render, &Render::PauseJob, of_job<v1::PauseJobRequest>(job));
  done(*render, &Render::ResumeJob, of_job<v1::ResumeJobRequest>(job));
  auto extend = of_job<v1::ExtendJobRequest>(job);
  extend.set_samples(1'000);
  done(*render, &Render::ExtendJob, extend);
  auto priority = of_job<v1::SetPriorityRequest>(job);
  priority.set_priority(3);
  done(*render, &Render::SetPriority, priority);
  done(*render, &Render::CancelJob, of_job<v1::CancelJobRequest>(job));
  done(*render, &Render::DeleteJob, of_job<v1::DeleteJobRequest>(job));
  {
    grpc::ClientContext context;
    const auto stub = v1::WorkerService::NewStub(machine);
    const auto stream = stub->Work(&context);
    WorkerHello hello;
    hello.name = "w1";
    hello.host = "h1";
    hello.threads = 3;
    hello.fingerprint_class = "class";
    hello.renderer_version = std::string(kRendererVersion);
    v1::WorkRequest request;
    to_wire(WorkerMessage(hello), &request);
    EXPECT_TRUE(stream->Write(request));
    v1::DrainWorkerRequest drain;
    drain.set_name("render-1/w1");
    v1::Worker worker;
    EXPECT_TRUE(eventually([&] {
      grpc::ClientContext try_it;
      return render->DrainWorker(&try_it, drain, &worker).ok();
    }));
    v1::QuarantineWorkerRequest quarantine;
    quarantine.set_name("render-1/w1");
    quarantine.set_reason("two\nlines");
    grpc::ClientContext refused;
    EXPECT_EQ(render->QuarantineWorker(&refused, quarantine, &worker).error_code(), StatusCode::INVALID_ARGUMENT);
    quarantine.set_reason("smells of smoke");
    done(*render, &v1::RenderService::Stub::QuarantineWorker, quarantine);
    v1::ReleaseWorkerRequest release;
    release.set_name("render-1/w1");
    done(*render, &v1::RenderService::Stub::ReleaseWorker, release);
    context.TryCancel();
    (void)stream->Finish();
  }
  {
    const NewToken own = make_token().value();
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + token_for(root, "render", {Role::enrol}));
    v1::EnrolRequest enrol;
    enrol.set_id(own.id);
    enrol.set_sha256(std::string(own.hash.bytes.begin(), own.hash.bytes.end()));
    enrol.set_host("node7");
    v1::Token made;
    EXPECT_TRUE(access->Enrol(&context, enrol, &made).ok());
    grpc::ClientContext repeated;
    repeated.AddMetadata("authorization", "Bearer " + token_for(root, "render", {Role::enrol}));
    EXPECT_TRUE(access->Enrol(&repeated, enrol, &made).ok()) << "a repetition is not recorded";
  }
  v1::RevokeTokenRequest revoke;
  revoke.set_id(token);
  done(*access, &v1::AccessService::Stub::RevokeToken, revoke);
}

TEST(ActionLog, EveryChangeIsRecordedWithWhoAndWhat) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  change_everything(root, secure.channel(secure.person("render-1", {Role::worker})));
  const std::vector<v1::Action> all = actions(root);
  EXPECT_EQ(lines(all),
            (std::vector<std::string>{
                "- job 0 Start done", "root by certificate job 0 CreateToken done",
                "root by certificate job 1 SubmitJob done", "root by certificate job 1 PauseJob done",
                "root by certificate job 1 ResumeJob done", "root by certificate job 1 ExtendJob done",
                "root by certificate job 1 SetPriority done", "root by certificate job 1 CancelJob done",
                "root by certificate job 1 DeleteJob done", "render-1 by certificate job 0 Work done",
                "root by certificate job 0 DrainWorker done", "root by certificate job 0 QuarantineWorker done",
                "root by certificate job 0 ReleaseWorker done", "root by certificate job 0 CreateToken done",
                "render by token job 0 Enrol done", "root by certificate job 0 CreateToken done",
                "root by certificate job 0 RevokeToken done"}));
  const std::int64_t now = system_clock().unix_milliseconds();
  std::map<std::string, std::string> seen;
  for (const v1::Action& action : all) {
    seen.emplace(action.operation(), change_of(action));
    EXPECT_NEAR(static_cast<double>(action.unix_ms()), static_cast<double>(now), 60'000);
    EXPECT_EQ(action.peer().starts_with("127.0.0.1:"), action.operation() != "Start") << action.peer();
  }
  EXPECT_EQ(all[14].token(), all[13].about().substr(0, 12));
  EXPECT_EQ(all[16].about().substr(0, 12), all[1].about().substr(0, 12));
  EXPECT_EQ(change_of(all[13]), "ID for render: created: roles enrol, valid for 24 hours, for 1 worker");

  // Someone who adds an RPC states here what it changes. The others are not recorded.
  for (const google::protobuf::MethodDescriptor* method : all_methods()) {
    ASSERT_TRUE(changes().contains(method->name())) << method->name() << " has no line in this table";
    const std::string& change = changes().at(method->name());
    EXPECT_EQ(seen[method->name()], change);
    if (change.empty()) {
      call(root, "/" + method->service()->full_name() + "/" + method->name(), "");
    }
  }
  EXPECT_EQ(actions(root).size(), all.size());

  v1::ListActionsRequest filter;
  filter.set_job(1);
  EXPECT_EQ(actions(root, filter).size(), 7u);
  filter.set_caller("render-1");
  EXPECT_EQ(actions(root, filter).size(), 0u);
  filter.clear_job();
  EXPECT_EQ(actions(root, filter).size(), 1u);
  filter.set_since_unix_ms(now + 3'600'000);
  EXPECT_EQ(actions(root, filter).size(), 0u);

  v1::RevokeTokenRequest revoke;
  revoke.set_id(all[13].about().substr(0, 12));
  revoke.set_enrolled(true);
  done(*v1::AccessService::NewStub(root), &v1::AccessService::Stub::RevokeToken, revoke);
  EXPECT_EQ(change_of(actions(root).back()), "ID of render: revoked: roles enrol, with 1 token that it enrolled");
}

TEST(ActionLog, RefusalsAreRecordedUpToALimit) {
  SecureFarm secure;
  const auto root = secure.channel(secure.person("root", {Role::admin}));
  const auto ada = secure.channel(secure.person("ada", {Role::submit}));
  const std::string token = token_for(root, "eve", {Role::submit});
  upload_assets(ada);
  const auto stub = v1::RenderService::NewStub(ada);
  v1::SubmitJobRequest submit;
  to_wire(job_of(Picture(), "one"), &submit);
  done(*stub, &v1::RenderService::Stub::SubmitJob, submit);
  done(*stub, &v1::RenderService::Stub::SubmitJob, submit);  // like a client that received no answer
  const auto anonymous = secure.channel(std::nullopt);
  const auto ask = [&](const std::string& method, const google::protobuf::Message& request, const std::string& by) {
    return call(anonymous, "/lightmill.v1.RenderService/" + method, request.SerializeAsString(), nullptr, by)
        .error_code();
  };
  EXPECT_EQ(ask("CancelJob", of_job<v1::CancelJobRequest>(1), token), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ask("GetJob", of_job<v1::GetJobRequest>(1), token), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ask("WatchJob", of_job<v1::WatchJobRequest>(1), token), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ask("GetFilm", of_job<v1::GetFilmRequest>(1), token), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ask("ListJobs", v1::ListJobsRequest(), ""), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(call(ada, "/lightmill.v1.AccessService/ListTokens", "").error_code(), StatusCode::PERMISSION_DENIED);
  const std::string viewer = token_for(root, "vic", {Role::view});
  EXPECT_EQ(ask("CancelJob", of_job<v1::CancelJobRequest>(7), viewer), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ask("GetFilm", of_job<v1::GetFilmRequest>(1), ""), StatusCode::UNAUTHENTICATED);
  const std::vector<std::string> expected{"- job 0 Start done",
                                          "root by certificate job 0 CreateToken done",
                                          "ada by certificate job 1 SubmitJob done",
                                          "eve by token job 1 CancelJob refused",
                                          "eve by token job 1 GetJob refused",
                                          "eve by token job 1 WatchJob refused",
                                          "eve by token job 1 GetFilm refused",
                                          "- job 0 ListJobs refused",
                                          "ada by certificate job 0 ListTokens refused",
                                          "root by certificate job 0 CreateToken done",
                                          "vic by token job 7 CancelJob refused",
                                          "- job 1 GetFilm refused"};
  EXPECT_EQ(lines(actions(root)), expected);
  EXPECT_EQ(actions(root)[3].token(), token_id(token).value());
  EXPECT_NE(actions(root)[3].message().find("the job belongs to another user"), std::string::npos);
  for (int i = 0; i < 300; ++i) {
    ask("ListJobs", v1::ListJobsRequest(), "");
  }
  EXPECT_EQ(lines(actions(root)), expected) << "the same again";
  for (std::uint64_t job = 1; job <= 300; ++job) {
    ask("GetJob", of_job<v1::GetJobRequest>(job), "");
  }
  EXPECT_LT(actions(root).size(), expected.size() + 150);
  EXPECT_GE(actions(root).size(), expected.size() + 90);
}

TEST(ActionLog, OutlivesTheCoordinatorAndRecordsHowItEnded) {
  SecureFarm secure;
  const auto root = [&] { return secure.channel(secure.person("root", {Role::admin})); };
  const std::string token = token_for(root(), "ada", {Role::submit});
  kill_at_once(secure.farm().server());
  secure.farm().start_server();
  EXPECT_EQ(lines(actions(root())),
            (std::vector<std::string>{"- job 0 Start done", "root by certificate job 0 CreateToken done",
                                      "- job 0 TakeOver done"}));
  secure.farm().server().send(SIGTERM);
  EXPECT_EQ(secure.farm().server().wait(), 0);
  secure.farm().start_server();
  EXPECT_EQ(lines(actions(root())),
            (std::vector<std::string>{"- job 0 Start done", "root by certificate job 0 CreateToken done",
                                      "- job 0 TakeOver done", "- job 0 Stop done", "- job 0 Start done"}));
}

}  // namespace
}  // namespace lightmill::test
