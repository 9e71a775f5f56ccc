// The coordinator on the network: store, state machine, farm thread and gRPC services, put together.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/security/tls_files.h"
#include "server/access/action_log.h"
#include "server/access/gate_options.h"
#include "server/domain/coordinator.h"
#include "server/store/asset_store.h"
#include "server/store/store.h"
#include "server/web/web_server.h"

namespace lightmill {

struct ApiOptions {
  std::string listen = "127.0.0.1:7350";  ///< host:port; port 0 takes a free one
  std::size_t connections = 1'000;        ///< at most
  /// With a certificate, connections are encrypted, and callers have to show who they are: by certificates of
  /// `authority`, if that is given, or by tokens.
  TlsFiles tls;
  GateOptions gate;
  std::vector<std::string> notices;  ///< told to who lists jobs or workers
  CoordinatorLimits limits;
  ActionLogLimits log;
  std::uint64_t wire_bytes = std::uint64_t{4} << 30;  ///< of what is on its way, of all connections
  std::optional<WebOptions> web;                      ///< also over HTTP
  /// The store cannot be used any more, or the port does not answer. From another thread; the server should be stopped.
  std::function<void(const Status&)> on_fatal = [](const Status&) {};
  /// Whether it takes jobs, which it does not while its state cannot be stored. From other threads.
  std::function<void(bool)> on_ready = [](bool) {};
};

/// A running coordinator.
class ApiServer {
 public:
  /// Loads the store and starts to listen. UNAVAILABLE if the address cannot be bound.
  static Result<std::unique_ptr<ApiServer>> start(std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
                                                  const ApiOptions& options);
  ~ApiServer();
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

  int port() const;
  /// No work is handed out, and jobs say why; empty: it is.
  void set_space(const std::string& why);
  /// Forgets assets that no job needs, nor did for a day; none while the farm is too busy to say which. Waits for the
  /// disk.
  void forget_unused_assets();
  int web_port() const;  ///< 0 without `web`
  /// Ends streams with UNAVAILABLE, answers what is under way, commits, and ends all threads. An error if something
  /// could not be stored.
  Status stop();

 private:
  struct Parts;
  explicit ApiServer(std::unique_ptr<Parts> parts);
  Status serve_web(const WebOptions& web);
  std::unique_ptr<Parts> parts_;
};

}  // namespace lightmill
