// The coordinator's gRPC server: for clients, workers, an autoscaler and health checks.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/base/status.h"
#include "common/security/tls_files.h"
#include "server/runtime/runtime.h"

namespace lightmill {

struct ApiOptions {
  std::string listen = "127.0.0.1:7350";  ///< host:port; port 0 takes a free one
  std::size_t connections = 1'000;        ///< limit
  /// With a certificate, connections are encrypted, and callers must authenticate: by certificates of `authority`, if
  /// given, or by tokens.
  TlsFiles tls = {};
  std::uint64_t wire_bytes = std::uint64_t{4} << 30;  ///< memory limit of messages in transit, of all connections
  /// Called from another thread if the port does not answer. The owner should then stop the server.
  std::function<void(const Status&)> on_fatal = [](const Status&) {};
  /// Whether the server accepts jobs. It does not while its state cannot be stored. Called from other threads.
  std::function<void(bool)> on_ready = [](bool) {};
};

/// One per runtime. The runtime outlives it.
class ApiServer {
 public:
  /// Starts to listen. UNAVAILABLE if the address cannot be bound.
  static Result<std::unique_ptr<ApiServer>> start(Runtime& runtime, const ApiOptions& options);
  /// Ends streams with UNAVAILABLE, and completes running calls.
  ~ApiServer();
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

  int port() const;

 private:
  struct Parts;
  explicit ApiServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace lightmill
