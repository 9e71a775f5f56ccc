// The coordinator over HTTP: the page's files, the JSON API, and the WebSocket on which the page hears what changes.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/security/tls_files.h"
#include "server/runtime/runtime.h"

namespace lightmill {

struct WebOptions {
  std::string listen;           ///< HOST:PORT; port 0 takes a free one
  std::filesystem::path pages;  ///< the folder of the built page; where there is none the API is served all the same
  std::string version;
  TlsFiles tls;                     ///< with a certificate, connections are encrypted
  std::vector<std::string> names;   ///< by which it is called, besides those of the certificate
  bool open_to_all = false;         ///< others may reach it without encryption, too
  std::size_t connections = 1'024;  ///< at most
  /// Memory of pictures that are made or on their way as files, and of those that pages look at.
  std::uint64_t file_bytes = std::uint64_t{2} << 30, view_bytes = std::uint64_t{1} << 30;
};

struct WebParts;

/// One thread for all connections, and a few for what takes its time; everything is bounded: their number, what each
/// may send, and how long it may take.
class WebServer {
 public:
  /// INVALID_ARGUMENT for an address that others can reach where nothing is encrypted, UNAVAILABLE if it cannot be
  /// bound; what is wrong with the certificate.
  static Result<std::unique_ptr<WebServer>> start(Runtime& runtime, const WebOptions& options);
  /// Hangs up on everybody. The runtime must still run.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;

 private:
  explicit WebServer(std::unique_ptr<WebParts> parts);
  std::unique_ptr<WebParts> parts_;
};

}  // namespace lightmill
