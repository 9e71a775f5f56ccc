// Health checks of a coordinator's own port: real gRPC servers, with and without TLS.
#include <grpc/support/log.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>

#include "common/base/file.h"
#include "common/security/authority.h"
#include "common/security/connection_problem.h"
#include "server/api/grpc_access.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

/// Answers no call.
class HangingService final : public grpc::CallbackGenericService {
  class Call final : public grpc::ServerGenericBidiReactor {
    void OnCancel() override { Finish(grpc::Status::CANCELLED); }
    void OnDone() override { delete this; }
  };
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override { return new Call(); }
};

/// The verdict on a server's port.
Status verdict(const TlsFiles& tls, bool hangs) {
  const std::unique_ptr<Listener> listener = Listener::open("127.0.0.1:0", "--listen", 8).value();
  grpc::EnableDefaultHealthCheckService(!hangs);
  HangingService service;
  grpc::ServerBuilder builder;
  leave_out_reflection(builder);
  Listener::Take take = serve_sockets(builder, server_credentials(tls));
  builder.RegisterCallbackGenericService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  listener->start(std::move(take));
  const int socket = listener->connect_to_self().value();
  Status status = check_answers(socket, tls.given());
  ::close(socket);
  listener->stop();
  server->Shutdown(std::chrono::system_clock::now());
  return status;
}

TEST(PortCall, AServerWhoseCallsHangDoesNotAnswer) {
  EXPECT_TRUE(verdict({}, false).ok()) << verdict({}, false);
  EXPECT_EQ(verdict({}, true), unavailable("no answer to a health check"));
}

TEST(PortCall, IsEncryptedWhereThePortIs) {
  gpr_set_log_function([](gpr_log_func_args*) {});
  const TemporaryFolder folder;
  const std::int64_t now = system_clock().unix_milliseconds() / 1000;
  const Validity hour{now - 60, now + 3600};
  const KeyAndCertificate authority = make_authority("farm", hour).value();
  const KeyAndCertificate made = issue_certificate(authority, {"farm", {"127.0.0.1"}, {}}, hour).value();
  const auto file = [&](const std::string& name, const std::string& text) {
    const std::string path = (folder.path() / name).string();
    EXPECT_TRUE(write_secret_file(path, as_byte_view(text), true).ok());
    return path;
  };
  TlsFiles tls;
  tls.certificate = file("server.pem", made.certificate + made.key);
  tls.authority = file("ca.pem", authority.certificate);
  EXPECT_TRUE(verdict(tls, false).ok()) << "callers need no certificate";
  EXPECT_EQ(verdict(tls, true), unavailable("no answer to a health check over TLS"));
}

}  // namespace
}  // namespace lightmill::test
