// The coordinator over HTTP: the page's files, the JSON API, and the WebSocket on which the page hears what changes.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "server/access/identity.h"
#include "server/api/farm_loop.h"

namespace lightmill {

struct WebOptions {
  std::string listen;           ///< HOST:PORT of the loopback; port 0 takes a free one
  std::filesystem::path pages;  ///< the folder of the built page; where there is none the API is served all the same
  std::string version;
  std::vector<std::string> notices;  ///< told to who lists jobs or workers
  /// Who sends a request, by its header Authorization (empty without one). UNAUTHENTICATED.
  std::function<Result<Identity>(std::string_view authorization)> identify;
};

struct WebParts;

/// One thread for all connections; everything is bounded: their number, what each may send, and how long it may take.
class WebServer {
 public:
  /// INVALID_ARGUMENT for an address that others can reach, UNAVAILABLE if it cannot be bound.
  static Result<std::unique_ptr<WebServer>> start(FarmLoop& loop, const WebOptions& options);
  /// Hangs up on everybody. The loop must still run.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;

 private:
  explicit WebServer(std::unique_ptr<WebParts> parts);
  std::unique_ptr<WebParts> parts_;
};

}  // namespace lightmill
