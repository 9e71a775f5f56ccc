// The gate as gRPC's calls come to it, and the encryption of its connections.
#pragma once

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/server_context.h>

#include <memory>

#include "common/security/tls_files.h"
#include "server/listen/listener.h"
#include "server/runtime/gate.h"

namespace lightmill {

/// Of every RPC, first, with what it names. UNAUTHENTICATED, PERMISSION_DENIED, RESOURCE_EXHAUSTED.
Result<Call> admit(const Gate& gate, const grpc::ServerContextBase& context, Rpc rpc, const About& about = {});

/// Encrypted if a certificate is given. Then its files are looked at every few seconds: renewed ones serve the
/// connections that come after.
std::shared_ptr<grpc::ServerCredentials> server_credentials(const TlsFiles& files);

/// Lets the builder's server serve sockets: those that it is given between its start and its shutdown.
Listener::Take serve_sockets(grpc::ServerBuilder& builder, const std::shared_ptr<grpc::ServerCredentials>& credentials);

/// Leaves out gRPC's service that describes the others, which serves everybody: linking it has put it in.
void leave_out_reflection(grpc::ServerBuilder& builder);

}  // namespace lightmill
