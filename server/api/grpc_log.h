// Log lines of gRPC.
#pragma once

namespace lightmill {

/// Passes them to the log of this process, for debugging. Failed TLS handshakes become warnings.
void redirect_grpc_log();

}  // namespace lightmill
