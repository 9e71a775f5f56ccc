#include "server/api/gate.h"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "common/base/log.h"

namespace lightmill {
namespace {

constexpr unsigned kReloadSeconds = 2;

}  // namespace

Result<Identity> Gate::identify(const grpc::ServerContextBase& context) const {
  if (!asks_) {
    return anybody();
  }
  const auto shown = context.auth_context();
  if (shown != nullptr && shown->IsPeerAuthenticated()) {
    const std::vector<grpc::string_ref> pem = shown->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
    if (!pem.empty()) {
      LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> facts,
                          read_certificates(std::string_view(pem.front().data(), pem.front().size())));
      return identity_of(facts.front(), now_unix_s());
    }
  }
  return make_error(StatusCode::kUnauthenticated, "this farm asks who calls: give a certificate ({})",
                    kCertificateOption);
}

Result<Identity> Gate::admit(const grpc::ServerContextBase& context, Rpc rpc) const {
  Result<Identity> caller = identify(context);
  const Status status = caller.ok() ? check_call(*caller, rpc) : caller.status();
  if (!status.ok()) {
    spdlog::info("{} from {} is refused: {}", rule_of(rpc).method, context.peer(), message_of(status));
    return status;
  }
  return caller;
}

Status Gate::check_still_holds(const Identity& identity) const {
  return lightmill::check_still_holds(identity, now_unix_s());
}

std::shared_ptr<grpc::ServerCredentials> server_credentials(const TlsFiles& files) {
  if (!files.given()) {
    return grpc::InsecureServerCredentials();
  }
  using grpc::experimental::FileWatcherCertificateProvider;
  grpc::experimental::TlsServerCredentialsOptions options(
      files.authority.empty()
          ? std::make_shared<FileWatcherCertificateProvider>(files.key_file(), files.certificate, kReloadSeconds)
          : std::make_shared<FileWatcherCertificateProvider>(files.key_file(), files.certificate, files.authority,
                                                             kReloadSeconds));
  options.watch_identity_key_cert_pairs();
  if (!files.authority.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace lightmill
