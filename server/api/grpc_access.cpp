#include "server/api/grpc_access.h"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/impl/server_builder_option.h>
#include <grpcpp/impl/server_builder_plugin.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "server/access/action_log.h"

namespace lightmill {

std::string peer_of(const grpc::ServerContextBase& context) {
  return peer_text(context.peer());
}

namespace {

constexpr unsigned kReloadSeconds = 2;
/// For TLS and HTTP/2 together. The caller is unknown until then.
constexpr int kHandshakeTimeoutMs = 5'000;
constexpr const char* kHeader = "authorization";

Credentials credentials_of(const grpc::ServerContextBase& context) {
  Credentials credentials;
  credentials.peer = peer_of(context);
  if (const auto header = context.client_metadata().find(kHeader); header != context.client_metadata().end()) {
    credentials.authorization.emplace(header->second.data(), header->second.size());
  }
  const auto proven = context.auth_context();
  if (proven != nullptr && proven->IsPeerAuthenticated()) {
    const std::vector<grpc::string_ref> pem = proven->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
    if (!pem.empty()) {
      credentials.certificate.assign(pem.front().data(), pem.front().size());
    }
  }
  return credentials;
}

class NoReflection final : public grpc::ServerBuilderOption {
 public:
  void UpdateArguments(grpc::ChannelArguments*) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins, [](const auto& plugin) {
      return dynamic_cast<grpc::reflection::ProtoServerReflectionPlugin*>(plugin.get()) != nullptr;
    });
  }
};

}  // namespace

Result<Call> admit(const AccessControl& access, const grpc::ServerContextBase& context, const Rpc& rpc,
                   const CallSubject& about, std::uint64_t request_bytes) {
  const Credentials credentials = credentials_of(context);
  Result<Identity> caller = access.identify(credentials);
  const bool lasts = rpc == kWork || stream_kind(rpc);
  if (caller.ok()) {
    // If the caller has its share of connections, this one remains unknown, and may end soon. That is enough for a
    // short call.
    if (const Status met = access.set_caller(credentials.peer, *caller); !met.ok() && lasts) {
      caller = met;
    }
  }
  Result<Call> call = access.admit(caller, credentials.peer, rpc, about);
  access.taken(credentials.peer, request_bytes, call.ok() ? UnreadBytes::kCallOverhead : 0);
  if (call.ok() && call->slot != nullptr) {
    call->slot->on_evict([&context] { context.TryCancel(); });
  }
  return call;
}

Listener::Take serve_sockets(grpc::ServerBuilder& builder,
                             const std::shared_ptr<grpc::ServerCredentials>& credentials) {
  using Builder = grpc::ServerBuilder::experimental_type;
  const std::shared_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor =
      builder.experimental().AddExternalConnectionAcceptor(Builder::ExternalConnectionType::FROM_FD, credentials);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeoutMs);
  // gRPC limits a message's bytes before it decompresses them. Nothing of ours is compressed.
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  return [acceptor](int socket, const std::string&) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = socket;
    acceptor->HandleNewConnection(&connection);
  };
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

void leave_out_reflection(grpc::ServerBuilder& builder) {
  builder.SetOption(std::make_unique<NoReflection>());
}

}  // namespace lightmill
