// Who calls: what a call has shown, as an identity, and whether its roles allow it.
#pragma once

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_context.h>

#include <memory>

#include "common/base/clock.h"
#include "common/security/tls_files.h"
#include "server/access/rights.h"

namespace lightmill {

/// Thread-safe.
class Gate {
 public:
  /// `asks`: callers have to show who they are; else everybody may do everything.
  Gate(bool asks, const Clock& clock) : asks_(asks), clock_(clock) {}

  /// Every handler's first step. UNAUTHENTICATED, PERMISSION_DENIED.
  Result<Identity> admit(const grpc::ServerContextBase& context, Rpc rpc) const;
  /// Of one that was admitted, while its stream lasts.
  Status check_still_holds(const Identity& identity) const;
  bool asks() const { return asks_; }

 private:
  Result<Identity> identify(const grpc::ServerContextBase& context) const;
  std::int64_t now_unix_s() const { return clock_.unix_milliseconds() / 1000; }

  const bool asks_;
  const Clock& clock_;
};

/// Encrypted if a certificate is given. Then its files are looked at every few seconds: renewed ones serve the
/// connections that come after.
std::shared_ptr<grpc::ServerCredentials> server_credentials(const TlsFiles& files);

}  // namespace lightmill
