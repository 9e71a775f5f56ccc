// Access over real connections with real certificates: all RPCs × all roles × own and others' jobs.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>

#include <fstream>

#include "common/wire/bytes.h"
#include "tests/integration/secure_farm.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

using grpc::StatusCode;

/// Access rights of an RPC, as in docs/operate/security.md. This is a second copy, written by hand.
struct Expectation {
  std::string roles;      ///< roles that can call it for every job
  std::string own_roles;  ///< roles that can call it for their own jobs
  StatusCode answer;      ///< status of an allowed call about a cancelled job or with an empty request
};

const std::map<std::string, Expectation>& expectations() {
  static const std::map<std::string, Expectation> all{
      {"RenderService/FindMissingAssets", {"worker submit operate admin", "", StatusCode::OK}},
      {"RenderService/UploadAsset", {"worker submit operate admin", "", StatusCode::INVALID_ARGUMENT}},
      {"RenderService/DownloadAsset", {"worker operate admin", "", StatusCode::INVALID_ARGUMENT}},
      {"RenderService/SubmitJob", {"submit operate admin", "", StatusCode::INVALID_ARGUMENT}},
      {"RenderService/InspectScene", {"submit operate admin", "", StatusCode::INVALID_ARGUMENT}},
      {"RenderService/GetJob", {"view operate admin", "submit view operate admin", StatusCode::OK}},
      {"RenderService/ListJobs", {"view submit operate admin", "", StatusCode::OK}},
      {"RenderService/CancelJob", {"operate admin", "submit operate admin", StatusCode::FAILED_PRECONDITION}},
      {"RenderService/PauseJob", {"operate admin", "submit operate admin", StatusCode::FAILED_PRECONDITION}},
      {"RenderService/ResumeJob", {"operate admin", "submit operate admin", StatusCode::FAILED_PRECONDITION}},
      {"RenderService/ExtendJob", {"operate admin", "submit operate admin", StatusCode::FAILED_PRECONDITION}},
      {"RenderService/SetPriority", {"operate admin", "submit operate admin", StatusCode::FAILED_PRECONDITION}},
      {"RenderService/DeleteJob", {"operate admin", "submit operate admin", StatusCode::OK}},
      {"RenderService/WatchJob", {"view operate admin", "submit view operate admin", StatusCode::OK}},
      {"RenderService/GetFilm", {"view operate admin", "submit view operate admin", StatusCode::OK}},
      {"RenderService/ListWorkers", {"view submit operate admin", "", StatusCode::OK}},
      {"RenderService/DrainWorker", {"operate admin", "", StatusCode::NOT_FOUND}},
      {"RenderService/QuarantineWorker", {"operate admin", "", StatusCode::NOT_FOUND}},
      {"RenderService/ReleaseWorker", {"operate admin", "", StatusCode::NOT_FOUND}},
      {"WorkerService/Work", {"worker", "", StatusCode::INVALID_ARGUMENT}},
      {"AccessService/CreateToken", {"admin", "", StatusCode::INVALID_ARGUMENT}},
      {"AccessService/ListTokens", {"admin", "", StatusCode::OK}},
      {"AccessService/RevokeToken", {"admin", "", StatusCode::NOT_FOUND}},
      {"AccessService/Enrol", {"enrol", "", StatusCode::INVALID_ARGUMENT}},
      {"AccessService/ListActions", {"admin", "", StatusCode::OK}},
      {"ExternalScaler/IsActive", {"view submit operate admin", "", StatusCode::OK}},
      {"ExternalScaler/StreamIsActive", {"view submit operate admin", "", StatusCode::CANCELLED}},  // by the caller
      {"ExternalScaler/GetMetricSpec", {"view submit operate admin", "", StatusCode::OK}},
      {"ExternalScaler/GetMetrics", {"view submit operate admin", "", StatusCode::INVALID_ARGUMENT}},
  };
  return all;
}

/// The field that names a job, or null.
const google::protobuf::FieldDescriptor* job_field(const google::protobuf::MethodDescriptor& method) {
  const google::protobuf::FieldDescriptor* const id = method.input_type()->FindFieldByName("id");
  return id != nullptr && id->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_UINT64 ? id : nullptr;
}

/// A request that is empty except for the job.
std::string request_for(const google::protobuf::MethodDescriptor& method, std::uint64_t job) {
  google::protobuf::DynamicMessageFactory factory;
  const std::unique_ptr<google::protobuf::Message> message(factory.GetPrototype(method.input_type())->New());
  if (const auto* id = job_field(method); id != nullptr) {
    message->GetReflection()->SetUInt64(message.get(), id, job);
  }
  return message->SerializeAsString();
}

TEST(Access, EveryRpcChecksRolesAndOwners) {
  SecureFarm secure;
  const auto ada = secure.channel(secure.person("ada", {Role::submit}));
  const auto bob = secure.channel(secure.person("bob", {Role::submit}));
  upload_assets(ada);
  struct Caller {
    std::string role;
    std::shared_ptr<grpc::Channel> channel;
    std::string token;
  };
  const auto root = secure.channel(secure.person("root", {Role::admin})), anonymous = secure.channel(std::nullopt);
  std::vector<Caller> callers{
      {"anonymous", anonymous, ""}, {"anonymous", root, make_token()->text}, {"anonymous", root, "rubbish"}};
  for (const Role role : kRoles) {
    const std::string name(name_of(role));
    callers.push_back({name, secure.channel(secure.person("ada", {role})), ""});
    callers.push_back({name, anonymous, token_for(root, "ada", {role})});
    // The token's roles count, not the certificate's.
    callers.push_back({name, root, token_for(root, "ada", {role})});
  }
  for (const google::protobuf::MethodDescriptor* method : all_methods()) {
    const std::string name = method->service()->name() + "/" + method->name();
    ASSERT_TRUE(expectations().contains(name)) << name << " has no line in this table";
    const Expectation& expected = expectations().at(name);
    const bool names_a_job = job_field(*method) != nullptr;
    for (const auto& [role, channel, token] : callers) {
      for (const bool own : {false, true}) {
        const std::uint64_t job = names_a_job ? ended_job(own ? ada : bob) : 0;
        const bool let_in = has_word(own && names_a_job ? expected.own_roles : expected.roles, role);
        const grpc::Status status = call(channel, "/" + method->service()->full_name() + "/" + method->name(),
                                         request_for(*method, job), nullptr, token);
        EXPECT_EQ(status.error_code(), let_in                ? expected.answer
                                       : role == "anonymous" ? StatusCode::UNAUTHENTICATED
                                                             : StatusCode::PERMISSION_DENIED)
            << name << " as " << role << (token.empty() ? " by certificate" : " by token")
            << (own ? ", own job: " : ", another's job: ") << status.error_message();
      }
    }
  }
}

TEST(Access, SubmittersSeeAndOwnOnlyTheirJobs) {
  SecureFarm secure;
  const auto ada = secure.channel(secure.person("ada", {Role::submit}));
  const auto bob = secure.channel(secure.person("bob", {Role::submit}));
  upload_assets(ada);
  const std::uint64_t adas = ended_job(ada), bobs = ended_job(bob);
  const auto listed = [&](const std::shared_ptr<grpc::Channel>& channel) {
    grpc::ClientContext context;
    v1::ListJobsResponse response;
    EXPECT_TRUE(v1::RenderService::NewStub(channel)->ListJobs(&context, {}, &response).ok());
    std::map<std::uint64_t, std::string> owners;
    for (const v1::Job& job : response.jobs()) {
      owners[job.id()] = job.owner();
    }
    return owners;
  };
  using Owners = std::map<std::uint64_t, std::string>;
  EXPECT_EQ(listed(ada), (Owners{{adas, "ada"}}));
  EXPECT_EQ(listed(bob), (Owners{{bobs, "bob"}}));
  EXPECT_EQ(listed(secure.channel(secure.person("eve", {Role::submit}))), Owners{});
  EXPECT_EQ(listed(secure.channel(secure.person("eve", {Role::view}))), (Owners{{adas, "ada"}, {bobs, "bob"}}));
}

TEST(Access, OneUserLeavesDiskToOthers) {
  SecureFarm secure(
      {"--user-disk-gib", "0.001"});  // 1,073,741 bytes for films, half for assets, a quarter for workers'
  const auto send = [&](const std::string& name, Role role, std::size_t bytes) {
    const std::string asset(bytes, name[0]);
    const auto stub = v1::RenderService::NewStub(secure.channel(secure.person(name, {role})));
    grpc::ClientContext context;
    v1::UploadAssetResponse response;
    const auto writer = stub->UploadAsset(&context, &response);
    v1::UploadAssetRequest request;
    request.set_digest(digest_bytes(sha256(asset)));
    request.set_chunk(asset);
    writer->Write(request);
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    EXPECT_TRUE(status.ok() || status.error_message().find("(--user-disk-gib") != std::string::npos)
        << status.error_message();
    return status.error_code();
  };
  EXPECT_EQ(send("ada", Role::submit, 500'000), StatusCode::OK);
  EXPECT_EQ(send("ada", Role::submit, 50'000), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(send("bob", Role::submit, 50'000), StatusCode::OK);
  EXPECT_EQ(send("w1", Role::worker, 250'000), StatusCode::OK);
  EXPECT_EQ(send("w2", Role::worker, 50'000), StatusCode::RESOURCE_EXHAUSTED) << "workers send for anyone";
  const auto bob = secure.channel(secure.person("bob", {Role::submit}));
  upload_assets(bob);
  Picture large;
  large.side = 256;
  v1::SubmitJobRequest request;
  to_wire(job_of(large, "large"), &request);
  grpc::ClientContext context;
  v1::Job job;
  const grpc::Status refused = v1::RenderService::NewStub(bob)->SubmitJob(&context, request, &job);
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_NE(refused.error_message().find("the films of 'bob' may need"), std::string::npos) << refused.error_message();
}

TEST(Access, ARequestIdOfAnotherUserRevealsNothing) {
  SecureFarm secure;
  const auto ada = secure.channel(secure.person("ada", {Role::submit}));
  const auto eve = secure.channel(secure.person("eve", {Role::submit}));
  upload_assets(ada);
  v1::SubmitJobRequest request;
  to_wire(job_of(Picture(), "the same"), &request);
  const auto submit = [&](const std::shared_ptr<grpc::Channel>& channel) {
    grpc::ClientContext context;
    v1::Job job;
    const StatusCode code = v1::RenderService::NewStub(channel)->SubmitJob(&context, request, &job).error_code();
    return std::pair(code, job.id());
  };
  EXPECT_EQ(submit(ada), std::pair(StatusCode::OK, std::uint64_t{1}));
  EXPECT_EQ(submit(ada), std::pair(StatusCode::OK, std::uint64_t{1}));
  EXPECT_EQ(submit(eve), std::pair(StatusCode::ALREADY_EXISTS, std::uint64_t{0}));
}

TEST(Access, UntrustedCallersCannotConnect) {
  SecureFarm secure;
  const KeyAndCertificate other = make_authority("Test farm", today()).value();
  const auto code = [&](const std::shared_ptr<grpc::Channel>& channel) {
    return call(channel, "/lightmill.v1.RenderService/ListJobs", "").error_code();
  };
  EXPECT_EQ(code(secure.channel(secure.person("ada", {Role::view}))), StatusCode::OK);
  EXPECT_EQ(code(secure.channel(issue_certificate(other, {"ada", {}, {Role::admin}}, today()).value())),
            StatusCode::UNAVAILABLE)
      << "signed by another authority of the same name";
  const Validity past{now_unix_s() - 2 * kDay, now_unix_s() - kDay};
  EXPECT_EQ(code(secure.channel(issue_certificate(secure.authority(), {"ada", {}, {Role::admin}}, past).value())),
            StatusCode::UNAVAILABLE)
      << "expired";
  EXPECT_EQ(code(secure.channel(issue_certificate(secure.authority(), {"x", {"127.0.0.1"}, {}}, today()).value())),
            StatusCode::UNAVAILABLE)
      << "a coordinator's certificate is no caller's";
  EXPECT_TRUE(eventually([&] {
    return secure.farm().times_said("server",
                                    "a TLS handshake on the port of --listen failed: certificate verify failed") >= 3;
  })) << "each is logged";
  EXPECT_EQ(code(grpc::CreateChannel(secure.farm().address(), grpc::InsecureChannelCredentials())),
            StatusCode::UNAVAILABLE)
      << "without TLS";
}

TEST(Access, CallersAreCheckedBeforeLargeRequestsAreRead) {
  SecureFarm secure;
  const std::string path = "/lightmill.v1.RenderService/", damaged(100'000, '\xff');
  const auto anonymous = secure.channel(std::nullopt), ada = secure.channel(secure.person("ada", {Role::submit}));
  for (const std::string method : {"SubmitJob", "FindMissingAssets", "InspectScene"}) {
    EXPECT_EQ(call(anonymous, path + method, damaged).error_code(), StatusCode::UNAUTHENTICATED) << method;
    EXPECT_EQ(call(ada, path + method, damaged).error_code(), StatusCode::INVALID_ARGUMENT) << method;
  }
  EXPECT_EQ(call(anonymous, path + "CancelJob", damaged).error_code(), StatusCode::UNAUTHENTICATED);
  const grpc::Status large = call(ada, path + "CancelJob", damaged);
  EXPECT_EQ(large.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(large.error_message(), "the request has 100000 bytes, a lightmill.v1.CancelJobRequest has at most 65536");
}

TEST(Access, HealthIsOpenToAllCallersAndReflectionToNone) {
  SecureFarm secure;
  const auto anonymous = secure.channel(std::nullopt);
  std::vector<std::string> replies;
  EXPECT_TRUE(call(anonymous, "/grpc.health.v1.Health/Check", "", &replies).ok());
  EXPECT_EQ(replies, std::vector{std::string("\x08\x01", 2)}) << "status: SERVING";
  EXPECT_EQ(
      call(anonymous, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", std::string("\x3a\x00", 2))
          .error_code(),
      StatusCode::UNIMPLEMENTED);
}

TEST(Access, RenewedCertificatesComeIntoUseWithoutARestart) {
  SecureFarm secure;
  const auto listed = [&] {
    return call(secure.channel(secure.person("ada", {Role::view})), "/lightmill.v1.RenderService/ListJobs", "").ok();
  };
  EXPECT_TRUE(listed());
  secure.renew_server({now_unix_s() - 2 * kDay, now_unix_s() - kDay});  // differs clearly from the old validity
  EXPECT_TRUE(eventually([&] { return !listed(); })) << "the expired certificate is still in use";
  const auto says = [&](const std::string& text) {
    return eventually([&] { return secure.farm().server_log().find(text) != std::string::npos; });
  };
  EXPECT_TRUE(says("the new certificate files cannot be used: --tls-cert"));
  secure.renew_server(today());
  EXPECT_TRUE(eventually(listed));
  EXPECT_TRUE(says("the files of the certificate are in order again"));
  EXPECT_TRUE(says("read the new certificate of --tls-cert " + secure.path("server.pem") + ": 'farm', valid until"));
  secure.write("ca.pem", secure.authority().certificate + make_authority("Next farm", today())->certificate);
  EXPECT_TRUE(says("read the new authorities of --tls-ca " + secure.path("ca.pem") + ": Test farm, Next farm"));
}

TEST(Access, AWorkerLogsEachNewReasonWhyItIsNotConnected) {
  SecureFarm secure;
  Farm& farm = secure.farm();
  const KeyAndCertificate own = secure.person("render-1", {Role::worker});
  const BackgroundProcess worker({program("lightmill-worker"), "--server", farm.address(), "--threads", "1", "--tls-ca",
                                  secure.write("known.pem", secure.authority().certificate), "--tls-cert",
                                  secure.write("render-1.pem", own.certificate + own.key), "--log-level", "debug"},
                                 (farm.folder() / "worker.log").string());
  const auto said = [&](const std::string& words, int times) {
    return eventually([&] { return farm.times_said("worker", words) >= times; });
  };
  ASSERT_TRUE(said("connected to", 1)) << farm.log("worker");
  kill_at_once(farm.server());
  EXPECT_TRUE(said(": nothing listens there. Start lightmill-server, or give another --server. The worker retries", 1))
      << farm.log("worker");
  EXPECT_TRUE(said("still no connection to", 2)) << farm.log("worker");
  const KeyAndCertificate other = make_authority("Other farm", today()).value();
  const KeyAndCertificate server = issue_certificate(other, {"farm", {"127.0.0.1"}, {}}, today()).value();
  secure.write("server.pem", server.certificate + server.key);
  farm.start_server();
  EXPECT_TRUE(said("its certificate is signed by 'Other farm', which is not the authority", 1)) << farm.log("worker");
  secure.renew_server(today());
  EXPECT_TRUE(said("connected to", 2)) << farm.log("worker");
  EXPECT_EQ(
      farm.times_said("worker",
                      ": nothing listens there. Start lightmill-server, or give another --server. The worker retries"),
      1)
      << farm.log("worker");
  EXPECT_EQ(farm.times_said("worker", "signed by 'Other farm'"), 1) << farm.log("worker");
}

TEST(Access, AWorkerWithACertificateRendersAndOneWithoutLogsTheReason) {
  SecureFarm secure;
  Farm& farm = secure.farm();
  const auto worker = [&](const std::string& name, std::vector<std::string> options) {
    options.insert(options.begin(),
                   {program("lightmill-worker"), "--server", farm.address(), "--threads", "1", "--name", name});
    return std::make_unique<BackgroundProcess>(options, (farm.folder() / (name + ".log")).string());
  };
  const auto says = [&](const std::string& name, const std::string& text) {
    return eventually([&] { return farm.log(name).find(text) != std::string::npos; });
  };
  const auto file = [&](const std::string& name, const KeyAndCertificate& made) {
    return secure.write(name, made.certificate + made.key);
  };
  const std::string ca = secure.path("ca.pem");
  const auto plain = worker("plain", {});
  EXPECT_TRUE(says("plain", "it accepts only encrypted connections: give --tls-ca")) << farm.log("plain");
  const auto nameless = worker("nameless", {"--tls-ca", ca});
  EXPECT_TRUE(says(
      "nameless",
      "this farm requires authentication, and got neither a certificate nor a token: give --tls-cert or --token-file"))
      << farm.log("nameless");
  const auto viewer = worker("viewer", {"--tls-ca", ca, "--tls-cert", file("v.pem", secure.person("v", {Role::view}))});
  EXPECT_TRUE(says("viewer", "may not render. Roles that may: worker")) << farm.log("viewer");
  const KeyAndCertificate other = make_authority("Other farm", today()).value();
  const auto lost = worker("lost", {"--tls-ca", secure.write("other.pem", other.certificate)});
  EXPECT_TRUE(says("lost", "its certificate is signed by 'Test farm', which is not the authority of --tls-ca"))
      << farm.log("lost");
  const auto foreign =
      worker("foreign", {"--tls-ca", ca, "--tls-cert",
                         file("s.pem", issue_certificate(other, {"s", {}, {Role::worker}}, today()).value())});
  EXPECT_TRUE(says("foreign", "it refuses the certificate of --tls-cert, signed by 'Other farm'"))
      << farm.log("foreign");

  const auto good = worker("good", {"--tls-ca", ca, "--tls-cert", file("w.pem", secure.person("w", {Role::worker}))});
  const auto ada = secure.channel(secure.person("ada", {Role::submit}));
  upload_assets(ada);
  const auto stub = v1::RenderService::NewStub(ada);
  Picture picture;
  picture.side = 64;
  picture.samples = 4;
  v1::SubmitJobRequest request;
  to_wire(job_of(picture, "one"), &request);
  v1::Job job;
  grpc::ClientContext submit;
  ASSERT_TRUE(stub->SubmitJob(&submit, request, &job).ok());
  EXPECT_TRUE(eventually([&] {
    grpc::ClientContext context;
    v1::GetJobRequest which;
    which.set_id(job.id());
    return stub->GetJob(&context, which, &job).ok() && job.state() == v1::JOB_STATE_DONE;
  })) << job.ShortDebugString()
      << farm.log("good");
  grpc::ClientContext list;
  v1::ListWorkersResponse workers;
  ASSERT_TRUE(stub->ListWorkers(&list, {}, &workers).ok());
  ASSERT_EQ(workers.workers_size(), 1);
  EXPECT_EQ(workers.workers(0).name(), "w/good") << "no caller can use another's name";
}

// All workers are on one machine. Only their certificates differ.
TEST(Access, WorkersAuditEachOtherIfTheyHaveTwoCertificates) {
  for (const bool two : {false, true}) {
    SecureFarm secure;
    std::vector<std::unique_ptr<BackgroundProcess>> workers;
    for (const std::string name : {"a", "b"}) {
      const std::string of = two ? name : "shared";
      const KeyAndCertificate made = secure.person(of, {Role::worker});
      workers.push_back(std::make_unique<BackgroundProcess>(
          std::vector<std::string>{program("lightmill-worker"), "--server", secure.farm().address(), "--threads", "1",
                                   "--name", name, "--tls-ca", secure.path("ca.pem"), "--tls-cert",
                                   secure.write(of + ".pem", made.certificate + made.key)},
          (secure.farm().folder() / (name + ".log")).string()));
    }
    const auto ada = secure.channel(secure.person("ada", {Role::submit}));
    upload_assets(ada);
    const auto stub = v1::RenderService::NewStub(ada);
    EXPECT_TRUE(eventually([&] {
      grpc::ClientContext context;
      v1::ListWorkersResponse listed;
      return stub->ListWorkers(&context, {}, &listed).ok() && listed.workers_size() == 2;
    }));
    Picture picture;
    picture.samples = 4;
    JobSpec spec = job_of(picture, "audited");
    spec.audit_share = 1;
    v1::SubmitJobRequest request;
    to_wire(spec, &request);
    v1::Job job;
    grpc::ClientContext submit;
    ASSERT_TRUE(stub->SubmitJob(&submit, request, &job).ok());
    EXPECT_TRUE(eventually([&] {
      grpc::ClientContext context;
      v1::GetJobRequest which;
      which.set_id(job.id());
      return stub->GetJob(&context, which, &job).ok() && job.state() == v1::JOB_STATE_DONE;
    })) << job.ShortDebugString();
    EXPECT_EQ(job.counters().results_audited(), two ? job.counters().results_merged() : 0u) << job.ShortDebugString();
    EXPECT_EQ(job.one_identity(), !two);
  }
}

}  // namespace
}  // namespace lightmill::test
