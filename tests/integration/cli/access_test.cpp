// Certificates on the command line: creating, showing and using them, and errors when they do not match.
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "client/cli/coordinator_client.h"
#include "common/security/connection_problem.h"
#include "common/security/openssl_handles.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class SecureCliTest : public CliTest {
 protected:
  void SetUp() override {
    json({"certs", "init", certs()});
    json({"certs", "server", certs(), "127.0.0.1"});
    json({"certs", "worker", certs(), "render-1"});
    json({"certs", "person", certs(), "ada"});
    json({"certs", "person", certs(), "bob", "--roles", "submit"});
  }
  std::string certs() const { return file("certs"); }
  std::string pem(const std::string& name) const { return certs() + "/" + name + ".pem"; }
  void start_server(const std::string& listen, const std::vector<std::string>& more) {
    std::filesystem::remove(file("port"));
    std::vector<std::string> arguments{
        program("lightmill-server"), "--data", file("data"), "--listen", listen, "--port-file", file("port")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    server_ = std::make_unique<BackgroundProcess>(arguments, file("server.log"));
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(file("port")) && !port().empty(); }));
  }
  std::string port() const {
    std::string text;
    std::ifstream(file("port")) >> text;
    return text;
  }
  std::vector<std::string> as(const std::string& name, std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--server", "127.0.0.1:" + port(), "--tls-ca", pem("ca")});
    if (!name.empty()) {
      arguments.insert(arguments.end(), {"--tls-cert", pem(name)});
    }
    return arguments;
  }
  std::string failure(const std::vector<std::string>& arguments, int exit_code = 2) const {
    return json(arguments, exit_code)["failure"].value("message", "");
  }

  std::unique_ptr<BackgroundProcess> server_;
};

TEST_F(SecureCliTest, CertificatesAreSecretAndNotOverwritten) {
  for (const char* name : {"/ca.key", "/server.pem", "/render-1.pem", "/ada.pem"}) {
    struct stat info {};
    ASSERT_EQ(::stat((certs() + name).c_str(), &info), 0) << name;
    EXPECT_EQ(info.st_mode & 0777, 0600u) << name;
  }
  std::filesystem::permissions(certs() + "/ca.key", std::filesystem::perms(0644));
  EXPECT_TRUE(
      says(failure({"certs", "person", certs(), "eve"}), "other users of this machine can read the authority's key"));
  std::filesystem::permissions(certs() + "/ca.key", std::filesystem::perms(0600));
  EXPECT_TRUE(says(failure({"certs", "init", certs()}), "there is an authority in " + certs()));
  const nlohmann::json before = json({"certs", "show", pem("ada")})["certificates"][0];
  EXPECT_EQ(before["name"], "ada");
  EXPECT_EQ(before["roles"], (nlohmann::json{"view", "submit"}));
  EXPECT_EQ(before["issuer"], "Lightmill farm");
  EXPECT_TRUE(says(failure({"certs", "person", certs(), "ada"}), "--replace"));
  EXPECT_TRUE(says(failure({"certs", "init", certs()}), "--replace"));
  EXPECT_EQ(json({"certs", "show", pem("ada")})["certificates"][0], before);
  EXPECT_FALSE(says(lightmill({"certs", "show", pem("ada")}).out, "UTC")) << "times are local, as in all commands";
  json({"certs", "person", certs(), "ada", "--replace", "--roles", "admin", "--days", "7"});
  const nlohmann::json after = json({"certs", "show", pem("ada")})["certificates"][0];
  EXPECT_EQ(after["roles"], nlohmann::json{"admin"});
  EXPECT_NE(after["sha256"], before["sha256"]);
  EXPECT_TRUE(
      says(failure({"certs", "person", certs(), "eve", "--roles", "root"}), "view, submit, operate, worker, admin"));
  EXPECT_TRUE(says(failure({"certs", "person", certs(), "../eve"}), "--out"));
  EXPECT_TRUE(says(failure({"certs", "person", certs(), "ca"}), "--out")) << "this name belongs to the authority";
  EXPECT_TRUE(says(failure({"certs", "person", file("none"), "eve"}), "lightmill certs init"));
}

TEST_F(SecureCliTest, ReplacingKeepsThePersonsRolesAndSaysWhatChanged) {
  const auto replaced = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "certs");
    arguments.emplace_back("--replace");
    const CommandResult result = lightmill(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  EXPECT_FALSE(says(replaced({"person", certs(), "bob"}), "it was"));
  EXPECT_EQ(json({"certs", "show", pem("bob")})["certificates"][0]["roles"], nlohmann::json{"submit"});
  EXPECT_TRUE(says(replaced({"person", certs(), "bob", "--roles", "view"}), "it was: roles submit"));
  EXPECT_EQ(json({"certs", "show", pem("bob")})["certificates"][0]["roles"], nlohmann::json{"view"});
  EXPECT_FALSE(says(replaced({"server", certs(), "127.0.0.1"}), "it was"));
  EXPECT_TRUE(says(replaced({"server", certs(), "farm.example"}), "it was: coordinator at 127.0.0.1"));
}

TEST_F(SecureCliTest, AMissingAuthorityKeyIsReportedWithARemedy) {
  std::filesystem::remove(certs() + "/ca.key");
  const std::string why = failure({"certs", "person", certs(), "zed"});
  EXPECT_TRUE(says(why, "the key of the authority in " + certs() + " is missing: put ca.key back")) << why;
  EXPECT_TRUE(says(why, "\"The CA key is lost\"")) << why;
  EXPECT_FALSE(says(why, "certs init")) << why;
}

TEST_F(SecureCliTest, ReplaceIsNamedOnlyWhereItWouldOverwrite) {
  for (const auto& [kind, name, there] :
       {std::tuple{"worker", "bob", "a person's certificate, of 'bob', not a worker's certificate, of 'bob'"},
        {"person", "server", "a coordinator's certificate, of '127.0.0.1', not a person's certificate, of 'server'"}}) {
    EXPECT_EQ(failure({"certs", kind, certs(), name}),
              fmt::format("{} holds {}: move it away first. Nothing was changed", pem(name), there));
  }
}

TEST_F(SecureCliTest, ReplacingTouchesNothingElse) {
  struct stat info {};
  ASSERT_EQ(::stat(pem("ca").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0644u) << "everyone may read it";
  const auto contents = [](const std::string& path) {
    std::ifstream stream(path);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const auto kept = [&](const std::vector<std::string>& arguments, const std::string& path) {
    const std::string before = contents(path);
    EXPECT_TRUE(says(failure(arguments), "Nothing was changed")) << path;
    EXPECT_EQ(contents(path), before) << path;
  };
  write("letter", "dear ada");
  kept({"certs", "person", certs(), "ada", "--out", file("letter"), "--replace"}, file("letter"));
  kept({"certs", "person", certs(), "ada", "--out", pem("bob"), "--replace"}, pem("bob"));
  kept({"certs", "person", certs(), "ada", "--out", pem("server"), "--replace"}, pem("server"));
  kept({"certs", "server", certs(), "127.0.0.1", "--out", pem("ada"), "--replace"}, pem("ada"));
  kept({"certs", "person", certs(), "ada", "--out", pem("ca"), "--replace"}, pem("ca"));
  kept({"certs", "worker", certs(), "ada", "--replace"}, pem("ada"));
  EXPECT_TRUE(says(failure({"certs", "worker", certs(), "ada", "--replace"}),
                   "holds a person's certificate, of 'ada', not a worker's certificate, of 'ada': move it away first"));
  kept({"certs", "person", certs(), "render-1", "--replace"}, pem("render-1"));
  EXPECT_TRUE(says(failure({"certs", "person", certs(), "render-1", "--replace"}), "holds a worker's certificate"));
  EXPECT_TRUE(says(failure({"certs", "server", certs(), "300.1.1.1", "--replace"}), "nor an IP address"));
  json({"certs", "server", certs(), "farm.example", "--replace"});
  json({"certs", "init", certs(), "--replace"});
}

TEST_F(SecureCliTest, PeopleUseTheFarmByTheirRoles) {
  start_server("0.0.0.0:0", {"--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  const nlohmann::json job =
      json(as("ada", {"submit", scene("cornell-bench-blocks.json"), "--owner", "bob", "--spp", "1"}));
  EXPECT_EQ(job["owner"], "ada") << "the owner is the name in her certificate";
  EXPECT_EQ(json(as("ada", {"jobs"}))["jobs"].size(), 1u);
  EXPECT_EQ(json(as("bob", {"jobs"}))["jobs"].size(), 0u);
  EXPECT_TRUE(says(failure(as("bob", {"cancel", "1"})), "the job belongs to another user"));
  EXPECT_TRUE(
      says(failure(as("", {"jobs"})), "got neither a certificate nor a token: give --tls-cert or --token-file"));
  EXPECT_TRUE(
      says(failure(as("render-1", {"jobs"})), "'render-1' (roles: worker; by certificate) may not see the farm"));
  EXPECT_EQ(json(as("ada", {"cancel", "1"}))["state"], "cancelled");
  const CommandResult workers = lightmill(as("ada", {"workers"}));
  EXPECT_TRUE(says(workers.out, "--tls-ca " + pem("ca") + " --enrol-file render.enrol")) << workers.out;
  EXPECT_TRUE(says(workers.out, fmt::format("--out render.enrol --server 127.0.0.1:{} --tls-ca {} --tls-cert {}`",
                                            port(), pem("ca"), pem("ada"))))
      << workers.out;
}

TEST_F(SecureCliTest, TheNameOfACertificateDrainsItsWorkers) {
  json({"certs", "person", certs(), "op", "--roles", "operate"});
  start_server("127.0.0.1:0", {"--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  const auto start_worker = [&](const std::string& name) {
    return std::make_unique<BackgroundProcess>(
        std::vector<std::string>{program("lightmill-worker"), "--server", "127.0.0.1:" + port(), "--tls-ca", pem("ca"),
                                 "--tls-cert", pem("render-1"), "--name", name, "--threads", "1"},
        file(name + ".log"));
  };
  const auto a = start_worker("a"), b = start_worker("b");
  ASSERT_TRUE(eventually([&] { return json(as("op", {"workers"}))["workers"].size() == 2; }));
  EXPECT_TRUE(says(failure(as("op", {"workers", "drain", "render-2"})),
                   "there is no worker 'render-2', and no worker has a certificate or token of this name"));
  const nlohmann::json drained = json(as("op", {"workers", "drain", "render-1"}))["workers"];
  ASSERT_EQ(drained.size(), 2u);
  EXPECT_EQ(drained[0]["name"], "render-1/a");
  EXPECT_EQ(drained[1]["name"], "render-1/b");
  EXPECT_EQ(a->wait(), 0);
  EXPECT_EQ(b->wait(), 0);
  std::ifstream log(file("a.log"));
  EXPECT_TRUE(says(std::string(std::istreambuf_iterator<char>(log), {}), "the farm knows this worker as render-1/a"));
}

TEST_F(SecureCliTest, OnlyTheCoordinatorsUserReadsItsState) {
  std::filesystem::create_directory(file("data"));
  ::chmod(file("data").c_str(), 0755);
  start_server("127.0.0.1:0", {});
  json({"submit", scene("cornell-bench-blocks.json"), "--spp", "1", "--server", "127.0.0.1:" + port()});
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(file("data"))) {
    ++files;
    EXPECT_EQ(entry.status().permissions() & std::filesystem::perms(077), std::filesystem::perms::none) << entry.path();
  }
  EXPECT_GE(files, 2);
}

TEST_F(SecureCliTest, MismatchedCertificatesAndTokensAreReported) {
  start_server("127.0.0.1:0", {"--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  const std::string here = "127.0.0.1:" + port();
  EXPECT_TRUE(says(failure({"jobs", "--server", here}), "it accepts only encrypted connections"));
  json({"certs", "init", file("other"), "--name", "Other farm"});
  EXPECT_TRUE(says(failure({"jobs", "--server", here, "--tls-ca", file("other/ca.pem")}),
                   "signed by 'Lightmill farm', which is not the authority of --tls-ca"));
  EXPECT_TRUE(says(failure({"jobs", "--server", "localhost:" + port(), "--tls-ca", pem("ca")}),
                   "its certificate is for 127.0.0.1, not for localhost"));
  json({"certs", "person", file("other"), "ada"});
  EXPECT_TRUE(says(failure({"jobs", "--server", here, "--tls-ca", pem("ca"), "--tls-cert", file("other/ada.pem")}),
                   "it refuses the certificate of --tls-cert, signed by 'Other farm'"));
  EXPECT_TRUE(says(failure({"jobs", "--server", here, "--tls-cert", pem("ada")}), "without --tls-ca"));
  EXPECT_FALSE(says(failure({"jobs", "--server", here, "--tls-ca", pem("ca"), "--tls-cert", pem("ca")}), "chmod"))
      << "it has no key";
  EXPECT_TRUE(says(failure({"jobs", "--server", here, "--tls-ca", file("none.pem")}), "--tls-ca " + file("none.pem")));
}

/// Accepts one TLS connection and closes it after the handshake, as a coordinator that ends. Then nothing listens.
class EndsAfterTheHandshake {
 public:
  explicit EndsAfterTheHandshake(const std::string& certificate)
      : context_(SSL_CTX_new(TLS_server_method())), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    EXPECT_EQ(SSL_CTX_use_certificate_file(context_.get(), certificate.c_str(), SSL_FILETYPE_PEM), 1);
    EXPECT_EQ(SSL_CTX_use_PrivateKey_file(context_.get(), certificate.c_str(), SSL_FILETYPE_PEM), 1);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_.number());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    const timeval timeout{kTimeout.count(), 0};
    EXPECT_EQ(::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout), 0);
    EXPECT_EQ(::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes), 0);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(socket_, 1), 0);
    thread_ = std::thread([this] {
      const int accepted = ::accept(socket_, nullptr, nullptr);
      ::close(socket_);
      const openssl::Connection connection(SSL_new(context_.get()));
      SSL_set_fd(connection.get(), accepted);
      EXPECT_EQ(SSL_accept(connection.get()), 1);
      ::close(accepted);
    });
  }
  ~EndsAfterTheHandshake() { thread_.join(); }
  EndsAfterTheHandshake(const EndsAfterTheHandshake&) = delete;
  EndsAfterTheHandshake& operator=(const EndsAfterTheHandshake&) = delete;
  std::string address() const { return fmt::format("127.0.0.1:{}", port_.number()); }

 private:
  const ReservedPort port_;
  const openssl::Context context_;
  const int socket_;
  std::thread thread_;
};

TEST_F(SecureCliTest, ACoordinatorThatEndsDoesNotRefuseACertificate) {
  const auto caller = read_caller({{pem("ca"), pem("ada"), ""}, "", ""}, {}, system_clock().unix_milliseconds() / 1000);
  ASSERT_TRUE(caller.ok()) << caller.status().message();
  const EndsAfterTheHandshake ending(pem("server"));
  EXPECT_EQ(connection_problem(ending.address(), caller->tls), std::nullopt);
}

TEST_F(SecureCliTest, TheFirstCallAfterARestartFindsTheCoordinator) {
  const ReservedPort reserved;
  const std::string address = fmt::format("127.0.0.1:{}", reserved.number());
  const std::vector<std::string> encrypted{"--tls-cert", pem("server"), "--tls-ca", pem("ca")};
  const auto caller = read_caller({{pem("ca"), pem("ada"), ""}, "", ""}, {}, system_clock().unix_milliseconds() / 1000);
  ASSERT_TRUE(caller.ok()) << caller.status().message();
  start_server(address, encrypted);
  cli::CoordinatorClient client(address, *caller);
  EXPECT_TRUE(client.probe(kTimeout).ok());
  server_->send(SIGKILL);
  server_->wait();
  for (int tries = 0; tries < 3; ++tries) {
    EXPECT_EQ(client.probe(kTimeout).code(), StatusCode::kUnavailable);
  }
  start_server(address, encrypted);
  const Status back = client.probe(kTimeout);
  EXPECT_TRUE(back.ok()) << back.message();
}

TEST_F(SecureCliTest, ThePortOfThePageIsNamedAsTheWrongOne) {
  const ReservedPort page;
  const std::string at = fmt::format("127.0.0.1:{}", page.number());
  start_server("127.0.0.1:0", {"--http", at, "--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  const std::string words = "a web server answers there. Give the port of lightmill-server's --listen";
  EXPECT_TRUE(says(failure({"jobs", "--server", at, "--tls-ca", pem("ca"), "--tls-cert", pem("ada")}, 3), words));
  server_->send(SIGTERM);
  server_->wait();
  start_server("127.0.0.1:0", {"--http", at});
  EXPECT_TRUE(says(failure({"jobs", "--server", at}, 3), words));
}

TEST_F(SecureCliTest, AnOpenFarmNeedsAnExplicitOptionAndWarns) {
  const auto start = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{program("lightmill-server"), "--data", file("data"), "--port-file",
                                       file("port")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_command(arguments);
  };
  for (const char* listen : {"0.0.0.0:0", "[::]:0", "127.evil.example:0"}) {
    const CommandResult refused = start({"--listen", listen});
    EXPECT_EQ(refused.exit_code, 2) << listen;
    EXPECT_TRUE(says(refused.err, "--insecure") && says(refused.err, "--tls-cert")) << refused.err;
  }
  EXPECT_TRUE(says(start({"--tls-cert", pem("ada")}).err, "names no host"));
  EXPECT_TRUE(says(start({"--tls-ca", pem("ca")}).err, "without --tls-cert"));
  start_server("0.0.0.0:0", {"--insecure"});
  const nlohmann::json listed = json({"jobs", "--server", "127.0.0.1:" + port()});
  ASSERT_EQ(listed["notices"].size(), 1u);
  EXPECT_TRUE(says(listed["notices"][0], "--insecure"));
  EXPECT_TRUE(says(lightmill({"workers", "--server", "127.0.0.1:" + port()}).err, "--insecure"));
  std::ifstream log(file("server.log"));
  EXPECT_TRUE(says(std::string(std::istreambuf_iterator<char>(log), {}), "this farm runs with --insecure"));
  EXPECT_TRUE(says(failure({"jobs", "--server", "127.0.0.1:" + port(), "--tls-ca", pem("ca")}),
                   "it does not accept encrypted connections"));
}

TEST_F(SecureCliTest, TokensAreCreatedListedAndRevoked) {
  json({"certs", "person", certs(), "root", "--roles", "admin"});
  start_server("127.0.0.1:0", {"--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  EXPECT_TRUE(json(as("root", {"tokens"}))["tokens"].empty());
  const nlohmann::json made = json(as("root", {"tokens", "create", "carl", "--roles", "submit", "--days", "2"}));
  EXPECT_EQ(made["roles"], nlohmann::json{"submit"});
  const CommandResult shown = lightmill(as("root", {"tokens", "create", "dora", "--out", file("dora")}));
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_FALSE(says(shown.out + shown.err, "lightmill_")) << "it is in the file alone";
  EXPECT_TRUE(says(shown.err, "It belongs to 'dora' (roles: view, submit)")) << shown.err;
  EXPECT_TRUE(says(failure(as("root", {"tokens", "create", "dora", "--out", file("dora")})),
                   file("dora") + " exists already: give another file with --out, or move it away first"));
  const CommandResult soon = lightmill(as("root", {"tokens"}));
  EXPECT_TRUE(says(soon.err, "a token expires within 14 days: carl.")) << soon.err;
  const nlohmann::json listed = json(as("root", {"tokens"}))["tokens"];
  ASSERT_EQ(listed.size(), 2u);
  EXPECT_FALSE(says(lightmill(as("root", {"tokens"})).out, "UTC")) << "times are local, as in all commands";
  EXPECT_EQ(listed[0]["id"], made["id"]);
  EXPECT_EQ(listed[0]["name"], "carl");
  EXPECT_EQ(listed[0]["made_by"], "root");
  EXPECT_FALSE(listed[0].contains("token"));
  EXPECT_TRUE(says(failure(as("ada", {"tokens"})), "may not manage tokens or read the log. Roles that may: admin"));

  const auto by_token = [&](std::vector<std::string> arguments) {
    return as("", [&] {
      arguments.insert(arguments.end(), {"--token-file", file("carl")});
      return arguments;
    }());
  };
  write("carl", made.value("token", ""));
  EXPECT_TRUE(says(failure(by_token({"jobs"})), "chmod 600"));
  ::chmod(file("carl").c_str(), 0600);
  EXPECT_EQ(json(by_token({"submit", scene("cornell-bench-blocks.json"), "--spp", "1"}))["owner"], "carl");
  EXPECT_EQ(json(as("", {"jobs", "--token-file", file("dora")}))["jobs"].size(), 1u);
  EXPECT_TRUE(says(failure({"jobs", "--server", "farm.invalid:7350", "--token-file", file("carl")}),
                   "unencrypted: give --tls-ca"));
  json(as("root", {"tokens", "revoke", made.value("id", "")}));
  EXPECT_TRUE(says(failure(by_token({"jobs"})), "is unknown here: it was revoked"));
  EXPECT_TRUE(says(failure(as("root", {"tokens", "revoke", made.value("id", "")})), "there is no token"));
}

TEST_F(SecureCliTest, EnrolmentTokensListTheirWorkers) {
  json({"certs", "person", certs(), "root", "--roles", "admin"});
  start_server("127.0.0.1:0", {"--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  const nlohmann::json made = json(
      as("root", {"tokens", "create", "render", "--enrol", "2", "--worker-days", "30", "--out", file("render.enrol")}));
  const std::string id = made.value("id", "");
  EXPECT_EQ(made["roles"], nlohmann::json{"enrol"});
  EXPECT_EQ(made["enrolment"], (nlohmann::json{{"workers", 2}, {"enrolled", 0}, {"worker_days", 30}}));
  const BackgroundProcess worker(as("", {program("lightmill-worker"), "--threads", "1", "--enrol-file",
                                         file("render.enrol"), "--state", file("state")}),
                                 file("worker.log"));
  nlohmann::json listed;
  ASSERT_TRUE(eventually([&] {
    listed = json(as("root", {"tokens"}))["tokens"];
    return listed.size() == 2;
  }));
  EXPECT_EQ(listed[0]["enrolment"]["enrolled"], 1);
  EXPECT_TRUE(listed[1].value("name", "").starts_with("render/")) << listed[1];
  EXPECT_EQ(listed[1]["roles"], nlohmann::json{"worker"});
  EXPECT_EQ(listed[1]["enrolled_by"], id);
  const std::string table = lightmill(as("root", {"tokens"})).out;
  EXPECT_TRUE(says(table, "enrol (1 of 2)") && says(table, "token " + id)) << table;
  EXPECT_TRUE(
      says(failure(as("", {"jobs", "--token-file", file("render.enrol")})), "'render' (roles: enrol; by token"));

  const CommandResult machine = lightmill(as("root", {"tokens", "revoke", listed[1].value("id", "")}));
  EXPECT_TRUE(says(machine.err, "its bearer can enrol again with token " + id)) << machine.err;
  ASSERT_TRUE(eventually([&] { return json(as("root", {"tokens"}))["tokens"].size() == 2; })) << "it has";
  const CommandResult closed = lightmill(as("root", {"tokens", "revoke", id}));
  EXPECT_TRUE(says(closed.err,
                   "the tokens of 1 worker that it enrolled are still valid: revoke them too with `lightmill tokens "
                   "revoke " +
                       id + " --enrolled`"))
      << closed.err;
  EXPECT_EQ(json(as("root", {"tokens"}))["tokens"].size(), 1u);
  EXPECT_EQ(json(as("root", {"tokens", "revoke", id, "--enrolled"}))["enrolled"], 1);
  EXPECT_TRUE(json(as("root", {"tokens"}))["tokens"].empty());

  EXPECT_TRUE(says(failure(as("root", {"tokens", "create", "x", "--roles", "enrol"})), "--enrol N"));
  EXPECT_TRUE(says(failure({"certs", "person", certs(), "x", "--roles", "enrol"}), "--enrol N"));
  EXPECT_EQ(lightmill({"tokens", "create", "x", "--enrol", "2", "--roles", "view"}).exit_code, 2);
  EXPECT_EQ(lightmill({"tokens", "create", "x", "--worker-days", "2"}).exit_code, 2);
}

TEST_F(SecureCliTest, TheLogSaysWhoDidWhat) {
  json({"certs", "person", certs(), "root", "--roles", "admin"});
  start_server("127.0.0.1:0", {"--tls-cert", pem("server"), "--tls-ca", pem("ca")});
  json(as("ada", {"submit", scene("cornell-bench-blocks.json"), "--spp", "1"}));
  json(as("ada", {"cancel", "1"}));
  EXPECT_TRUE(says(failure(as("ada", {"log"})), "may not manage tokens or read the log. Roles that may: admin"));
  const nlohmann::json log = json(as("root", {"log"}))["actions"];
  ASSERT_EQ(log.size(), 4u) << log;
  EXPECT_EQ(log[0]["operation"], "Start");
  EXPECT_EQ(log[2]["operation"], "CancelJob");
  EXPECT_EQ(log[2]["caller"], "ada");
  EXPECT_EQ(log[2]["proof"], "certificate");
  EXPECT_EQ(log[2]["job"], 1);
  EXPECT_EQ(log[2]["done"], true);
  EXPECT_EQ(log[2]["change"], "state queued -> cancelled");
  EXPECT_EQ(log[3]["done"], false);
  EXPECT_TRUE(says(log[3]["message"], "Roles that may: admin"));
  EXPECT_EQ(json(as("root", {"log", "--last", "1"}))["actions"], nlohmann::json::array({log[3]}));
  EXPECT_EQ(json(as("root", {"log", "--job", "1"}))["actions"].size(), 2u);
  EXPECT_EQ(json(as("root", {"log", "--caller", "ada", "--since", "2h"}))["actions"].size(), 3u);
  const CommandResult shown = lightmill(as("root", {"log"}));
  EXPECT_TRUE(says(shown.out, "state queued -> cancelled") && says(shown.out, "may not manage tokens or read the log"))
      << shown.out;
}

TEST_F(SecureCliTest, OnOneMachineTokensWorkWithoutCertificates) {
  start_server("127.0.0.1:0", {"--authenticate"});
  std::ifstream log(file("server.log"));
  EXPECT_TRUE(says(std::string(std::istreambuf_iterator<char>(log), {}),
                   "no caller can use this farm, because it requires tokens"));
  server_.reset();
  start_server("127.0.0.1:0", {});
  const std::string here = "127.0.0.1:" + port();
  json({"tokens", "create", "carl", "--roles", "submit", "--server", here, "--out", file("carl")});
  EXPECT_TRUE(says(failure({"tokens", "--server", here, "--token-file", file("carl")}), "Roles that may: admin"));
  EXPECT_EQ(json({"tokens", "--server", here})["tokens"].size(), 1u)
      << "a caller without credentials may do everything";
  server_.reset();
  std::filesystem::remove(file("port"));
  start_server("127.0.0.1:0", {"--authenticate"});
  const std::string there = "127.0.0.1:" + port();
  EXPECT_TRUE(says(failure({"jobs", "--server", there}), "and got no token: give --token-file"));
  EXPECT_EQ(json({"jobs", "--server", there, "--token-file", file("carl")})["jobs"].size(), 0u);
  server_.reset();
  std::filesystem::remove(file("port"));
  start_server("127.0.0.1:0", {"--tls-cert", pem("server")});
  EXPECT_EQ(json(as("", {"jobs", "--token-file", file("carl")}))["jobs"].size(), 0u);
  EXPECT_TRUE(says(failure(as("ada", {"jobs"})), "and got no token: give --token-file")) << "no authority was named";
  server_.reset();
  std::filesystem::remove(file("port"));
  start_server("0.0.0.0:0", {"--insecure"});
  EXPECT_TRUE(says(failure({"jobs", "--server", "127.0.0.1:" + port(), "--token-file", file("carl")}),
                   "this farm takes no tokens"));
}

}  // namespace
}  // namespace lightmill::test
