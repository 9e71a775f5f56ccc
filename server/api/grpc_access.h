// Admission of gRPC calls, and TLS of their connections.
#pragma once

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/server_context.h>

#include <memory>

#include "common/security/tls_files.h"
#include "server/listen/listener.h"
#include "server/runtime/access_control.h"

namespace lightmill {

/// Every RPC calls it first, with its subject, and the bytes of its request if that is small. UNAUTHENTICATED,
/// PERMISSION_DENIED, RESOURCE_EXHAUSTED.
Result<Call> admit(const AccessControl& access, const grpc::ServerContextBase& context, const Rpc& rpc,
                   const CallSubject& about = {}, std::uint64_t request_bytes = 0);

/// What a client sends while it receives this many bytes: window updates. For AccessControl::taken.
inline std::uint64_t overhead_of_sent(std::uint64_t bytes) {
  return UnreadBytes::kMessageOverhead + bytes / UnreadBytes::kOverheadShare / 4;
}

/// ADDRESS:PORT of the call.
std::string peer_of(const grpc::ServerContextBase& context);

/// Encrypted if a certificate is given. Its files are checked every few seconds. New connections use renewed ones.
std::shared_ptr<grpc::ServerCredentials> server_credentials(const TlsFiles& files);

/// Lets the builder's server serve sockets that are passed to it between its start and its shutdown.
Listener::Take serve_sockets(grpc::ServerBuilder& builder, const std::shared_ptr<grpc::ServerCredentials>& credentials);

/// Removes gRPC's reflection service, which admits every caller. Linking has added it.
void leave_out_reflection(grpc::ServerBuilder& builder);

}  // namespace lightmill
