// The coordinator's web server: the page's files, the JSON API, and the WebSocket for live updates.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "common/security/tls_files.h"
#include "server/runtime/runtime.h"

namespace lightmill {

struct WebOptions {
  std::string listen;           ///< HOST:PORT; port 0 takes a free one
  std::filesystem::path pages;  ///< folder of the built page; if it does not exist, only the API is served
  std::string version;
  TlsFiles tls;                     ///< with a certificate, connections are encrypted
  std::vector<std::string> names;   ///< host names, besides those of the certificate
  bool open_to_all = false;         ///< other machines may use it without encryption
  std::size_t connections = 1'024;  ///< limit
  /// Memory limits: pictures that are made or downloaded, and pictures that open pages show.
  std::uint64_t file_bytes = std::uint64_t{2} << 30, view_bytes = std::uint64_t{1} << 30;
  Duration timeout = std::chrono::seconds(30);  ///< a connection is closed after this time of silence
};

struct WebParts;

/// One thread serves all connections, and a few do slow work. The number of connections, their requests' sizes and
/// their time are limited.
class WebServer {
 public:
  /// INVALID_ARGUMENT if other machines can reach the address and it is not encrypted. UNAVAILABLE if the address
  /// cannot be bound. Also returns errors of the certificate.
  static Result<std::unique_ptr<WebServer>> start(Runtime& runtime, const WebOptions& options);
  /// Closes all connections. The runtime must still run.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;

 private:
  explicit WebServer(std::unique_ptr<WebParts> parts);
  std::unique_ptr<WebParts> parts_;
};

}  // namespace lightmill
