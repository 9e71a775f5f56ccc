// Enrolment over real connections: machines get and keep their own token, up to the allowed number.
#include <csignal>
#include <fstream>

#include <nlohmann/json.hpp>

#include "common/base/address.h"
#include "tests/integration/secure_farm.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

using grpc::StatusCode;

class Enrolment : public ::testing::Test {
 protected:
  std::shared_ptr<grpc::Channel> root() const { return secure_.channel(secure_.person("root", {Role::admin})); }

  /// Registers an enrolment token, and returns its text.
  std::string enrolment_token(std::uint32_t workers) const {
    return token_for(root(), "render", {Role::enrol}, now_unix_s() + kDay, workers);
  }
  std::vector<v1::Token> tokens() const {
    grpc::ClientContext context;
    v1::ListTokensResponse response;
    EXPECT_TRUE(v1::AccessService::NewStub(root())->ListTokens(&context, {}, &response).ok());
    return {response.tokens().begin(), response.tokens().end()};
  }
  /// The number of machines that the token has enrolled, according to the coordinator.
  std::uint32_t enrolled(const std::string& text) const {
    for (const v1::Token& token : tokens()) {
      if (token.id() == token_id(text).value()) {
        return token.enrolment().enrolled();
      }
    }
    return 0;
  }
  grpc::Status enrol(const std::string& by, const NewToken& own, const std::string& host,
                     v1::Token* made = nullptr) const {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + by);
    v1::EnrolRequest request;
    request.set_id(own.id);
    request.set_sha256(std::string(own.hash.bytes.begin(), own.hash.bytes.end()));
    request.set_host(host);
    v1::Token ignored;
    return v1::AccessService::NewStub(secure_.channel(std::nullopt))
        ->Enrol(&context, request, made != nullptr ? made : &ignored);
  }
  v1::RevokeTokenResponse revoke(const std::string& id, bool with_enrolled = false) const {
    v1::RevokeTokenRequest request;
    request.set_id(id);
    request.set_enrolled(with_enrolled);
    v1::RevokeTokenResponse response;
    grpc::ClientContext context;
    const grpc::Status status = v1::AccessService::NewStub(root())->RevokeToken(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  void restart_coordinator() {
    kill_at_once(secure_.farm().server());
    secure_.farm().start_server();
  }

  std::unique_ptr<BackgroundProcess> worker(const std::string& file, const std::string& log = "worker",
                                            std::vector<std::string> more = {},
                                            const std::string& state = "state") const {
    std::vector<std::string> arguments{program("lightmill-worker"),
                                       "--server",
                                       secure_.farm().address(),
                                       "--threads",
                                       "1",
                                       "--tls-ca",
                                       secure_.path("ca.pem"),
                                       "--enrol-file",
                                       file,
                                       "--state",
                                       secure_.path(state)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return std::make_unique<BackgroundProcess>(arguments, (secure_.farm().folder() / (log + ".log")).string());
  }
  /// Names of connected workers, without process numbers.
  std::set<std::string> identities() const {
    grpc::ClientContext context;
    v1::ListWorkersResponse response;
    EXPECT_TRUE(v1::RenderService::NewStub(root())->ListWorkers(&context, {}, &response).ok());
    std::set<std::string> names;
    for (const v1::Worker& each : response.workers()) {
      if (!each.away()) {
        names.insert(each.name().substr(0, each.name().rfind('/')));
      }
    }
    return names;
  }
  bool come_to_be(const std::set<std::string>& expected) const {
    return eventually([&] { return identities() == expected; });
  }
  bool says(const std::string& words, const std::string& log = "worker") const {
    return eventually([&] { return secure_.farm().log(log).find(words) != std::string::npos; });
  }
  std::string state(const std::string& file) const { return secure_.path("state/" + file); }

  const std::string first_ = "render/" + host_name(), second_ = first_ + "-2";
  SecureFarm secure_;
};

TEST_F(Enrolment, UsesAreCountedAcrossAKillOfTheCoordinator) {
  const std::string by = enrolment_token(2);
  const NewToken one = make_token().value(), two = make_token().value(), three = make_token().value();
  v1::Token made, again;
  ASSERT_TRUE(enrol(by, one, "a", &made).ok());
  EXPECT_EQ(made.name(), "render/a");
  EXPECT_EQ(made.enrolled_by(), token_id(by).value());
  restart_coordinator();
  EXPECT_EQ(enrolled(by), 1u);
  ASSERT_TRUE(enrol(by, one, "a", &again).ok()) << "a request whose answer was lost";
  EXPECT_EQ(again.SerializeAsString(), made.SerializeAsString());
  EXPECT_EQ(enrolled(by), 1u);
  EXPECT_TRUE(enrol(by, two, "b").ok());
  restart_coordinator();
  const grpc::Status refused = enrol(by, three, "c");
  EXPECT_EQ(refused.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_NE(refused.error_message().find("has enrolled all of its 2 workers"), std::string::npos)
      << refused.error_message();
  EXPECT_TRUE(enrol(by, one, "a").ok());
  EXPECT_EQ(call(secure_.channel(std::nullopt), "/lightmill.v1.RenderService/ListJobs", "", nullptr, by).error_code(),
            StatusCode::PERMISSION_DENIED)
      << "it is of no other use";
}

TEST_F(Enrolment, AWorkerEnrolsOnceAndComesBackWithItsOwnToken) {
  const std::string by = enrolment_token(1);
  const std::string file = secure_.write("enrol", by);
  auto process = worker(file);
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  process->send(SIGKILL);
  process->wait();
  const std::string own = read_file(state("1/token")).value();
  EXPECT_NE(own, by + "\n");
  EXPECT_EQ(std::filesystem::status(state("1/token")).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  ASSERT_TRUE(come_to_be({}));
  std::filesystem::remove(file);
  process = worker(file);
  EXPECT_TRUE(come_to_be({first_})) << "without the file" << secure_.farm().log("worker");
  EXPECT_EQ(read_file(state("1/token")).value(), own);
  EXPECT_EQ(enrolled(by), 1u);
}

TEST_F(Enrolment, AWorkerComesBackWithItsOwnTokenAfterAnotherFarmWasAtTheAddress) {
  const std::string by = enrolment_token(1);
  const auto process = worker(secure_.write("enrol", by));
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  revoke(token_id(by).value());  // as the worker's token outlives it
  const std::filesystem::path data = secure_.farm().data(), kept = secure_.path("kept");
  kill_at_once(secure_.farm().server());
  std::filesystem::rename(data, kept);
  secure_.farm().start_server();
  EXPECT_TRUE(says("is unknown here") && says("enrolment with --enrol-file")) << secure_.farm().log("worker");
  kill_at_once(secure_.farm().server());
  std::filesystem::remove_all(data);
  std::filesystem::rename(kept, data);
  secure_.farm().start_server();
  EXPECT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
}

TEST_F(Enrolment, AWorkerWhoseAnswerWasLostRepeatsItsRequest) {
  const std::string by = enrolment_token(1);
  const NewToken asked = make_token().value();
  std::filesystem::create_directories(state("1"));
  ASSERT_TRUE(write_secret_file(state("1/token.asked"), as_byte_view(asked.text + "\n"), false).ok());
  ASSERT_TRUE(enrol(by, asked, host_name()).ok());
  const auto process = worker(secure_.write("enrol", by));
  EXPECT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  EXPECT_EQ(read_file(state("1/token")).value(), asked.text + "\n");
  EXPECT_FALSE(std::filesystem::exists(state("1/token.asked")));
}

TEST_F(Enrolment, EachWorkerOfAMachineHasAnIdentityUpToTheUses) {
  const std::string file = secure_.write("enrol", enrolment_token(2));
  const auto one = worker(file, "one");
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("one");
  const auto two = worker(file, "two");
  ASSERT_TRUE(come_to_be({first_, second_})) << secure_.farm().log("two");
  const auto three = worker(file, "three");
  EXPECT_TRUE(says("refused by", "three"));
  EXPECT_TRUE(says("enrolment with --enrol-file " + file, "three")) << secure_.farm().log("three");
  EXPECT_TRUE(says(
      "has enrolled all of its 2 workers: an admin can create another with `lightmill tokens create render", "three"));
  secure_.write("enrol", enrolment_token(1));
  EXPECT_TRUE(come_to_be({first_, second_, first_ + "-3"})) << "with another file" << secure_.farm().log("three");
}

TEST_F(Enrolment, AWorkerWhoseTokenIsRevokedEnrolsAgainWhileUsesAreLeft) {
  const std::string by = enrolment_token(2);
  const auto process = worker(secure_.write("enrol", by));
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  const auto own_id = [&] { return token_id(read_file(state("1/token"))->substr(0, 87)).value(); };
  const std::string before = own_id();
  EXPECT_EQ(revoke(before).enrols_again_by(), token_id(by).value());
  EXPECT_TRUE(eventually([&] { return own_id() != before && identities() == std::set{first_}; }))
      << secure_.farm().log("worker");
  EXPECT_EQ(enrolled(by), 2u);
  EXPECT_EQ(revoke(own_id()).enrols_again_by(), "") << "no use is left";
  EXPECT_TRUE(says("has enrolled all of its 2 workers")) << secure_.farm().log("worker");
  EXPECT_TRUE(come_to_be({}));
}

TEST_F(Enrolment, ABusyWorkerSurvivesItsNewName) {
  const std::string first = enrolment_token(1);
  const std::string file = secure_.write("enrol", first);
  const auto process = worker(file);
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  const KeyAndCertificate ada = secure_.person("ada", {Role::submit, Role::view});
  const std::vector<std::string> farm{"--server",   secure_.farm().address(),
                                      "--tls-ca",   secure_.path("ca.pem"),
                                      "--tls-cert", secure_.write("ada.pem", ada.certificate + ada.key)};
  const auto lightmill = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program("lightmill"));
    arguments.insert(arguments.end(), farm.begin(), farm.end());
    return run_command(arguments);
  };
  const CommandResult submitted =
      lightmill({"submit", source_file("scenes/cornell-bench-blocks.json"), "--size", "64x64", "--spp", "65536"});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  const auto samples = [&] {
    return nlohmann::json::parse(lightmill({"show", "1", "--json"}).out)["samples_done"].get<std::int64_t>();
  };
  ASSERT_TRUE(eventually([&] { return lightmill({"fetch", "1", "-o", secure_.path("a.png")}).exit_code == 0; }));
  // The new token has another name, and so has the worker. It holds leases of its old one.
  secure_.write("enrol", token_for(root(), "other", {Role::enrol}, now_unix_s() + kDay, 1));
  revoke(token_id(first).value(), true);
  ASSERT_TRUE(come_to_be({"other/" + host_name()})) << secure_.farm().log("worker");
  EXPECT_TRUE(says("Results under the old name are dropped"));
  const std::int64_t before = samples();
  EXPECT_TRUE(eventually([&] { return samples() > before; })) << secure_.farm().log("worker");
}

TEST_F(Enrolment, RevokingAnEnrolmentTokenKeepsItsWorkersByDefault) {
  const std::string by = enrolment_token(3);
  const std::string id = token_id(by).value();
  const std::string file = secure_.write("enrol", by);
  const auto process = worker(file);
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  const NewToken other = make_token().value();
  ASSERT_TRUE(enrol(by, other, "other").ok());
  EXPECT_EQ(revoke(id).enrolled(), 2u);
  EXPECT_EQ(enrol(by, make_token().value(), "late").error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(tokens().size(), 2u);
  EXPECT_EQ(identities(), std::set{first_});
  restart_coordinator();
  ASSERT_TRUE(come_to_be({first_})) << secure_.farm().log("worker");
  EXPECT_EQ(revoke(id, true).enrolled(), 2u);
  EXPECT_TRUE(come_to_be({}));
  EXPECT_TRUE(tokens().empty());
  EXPECT_TRUE(says("is unknown here: it was revoked")) << secure_.farm().log("worker");
  restart_coordinator();
  EXPECT_TRUE(tokens().empty());
  v1::RevokeTokenRequest request;
  request.set_id(id);
  request.set_enrolled(true);
  v1::RevokeTokenResponse response;
  grpc::ClientContext context;
  EXPECT_EQ(v1::AccessService::NewStub(root())->RevokeToken(&context, request, &response).error_code(),
            StatusCode::NOT_FOUND);
}

TEST_F(Enrolment, AWorkerThatCannotEnrolSaysWhatToDo) {
  const auto fails = [&](const std::string& file, std::vector<std::string> more, int code, const std::string& words,
                         const std::string& state = "state") {
    EXPECT_EQ(worker(file, "failing", std::move(more), state)->wait(), code) << words;
    EXPECT_NE(secure_.farm().log("failing").find(words), std::string::npos) << secure_.farm().log("failing");
  };
  fails(secure_.path("none"), {}, 1,
        fmt::format("this worker has no token in {} yet: --enrol-file {}", state("1"), secure_.path("none")));
  const std::string file = secure_.write("enrol", enrolment_token(1));
  fails(file, {"--token-file", file}, 2, "--enrol-file and a token (--token-file or LIGHTMILL_TOKEN) are both given");
  fails(file, {}, 1, "cannot create the state folder " + file + "/1", "enrol");
  std::filesystem::permissions(file, std::filesystem::perms::all);
  fails(file, {}, 1, "chmod 600");
  EXPECT_EQ(worker(file, "with a file", {}, "state")->wait(), 1);
  EXPECT_EQ(secure_.farm().log("with a file").find("Make an enrolment token"), std::string::npos) << "it has one";
}

TEST_F(Enrolment, ATokenOfAnotherKindIsRefusedByName) {
  const std::string file = secure_.write("enrol", token_for(root(), "ada", {Role::submit}));
  const auto process = worker(file);
  EXPECT_TRUE(says("'ada' (roles: submit; by token") && says(") may not enrol. Roles that may: enrol"))
      << secure_.farm().log("worker");
}

}  // namespace
}  // namespace lightmill::test
