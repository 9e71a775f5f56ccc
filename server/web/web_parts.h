// Parts of the web server, for the files that serve connections.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>

#include <optional>
#include <thread>

#include "common/base/mutex.h"
#include "server/listen/handshake_log.h"
#include "server/listen/listener.h"
#include "server/web/http_authenticator.h"
#include "server/web/http_body.h"
#include "server/web/json_api.h"
#include "server/web/live_hub.h"
#include "server/web/page_files.h"
#include "server/web/request_rules.h"
#include "server/web/served_certificate.h"
#include "server/web/web_server.h"

namespace lightmill {

/// Lets other threads post tasks to the web thread, even after it has ended.
struct Mailbox {
  Mutex mutex;
  boost::asio::io_context* io LM_GUARDED_BY(mutex) = nullptr;

  void post(std::function<void()> task) {
    const MutexLock lock(mutex);
    if (io != nullptr) {
      boost::asio::post(*io, std::move(task));
    }
  }
  void set(boost::asio::io_context* to) {
    const MutexLock lock(mutex);
    io = to;
  }
};

/// Used on the thread that runs `io`, except the mailbox and the listener.
struct WebParts {
  WebParts(Runtime& runtime, const WebOptions& web, ServedCertificate served, PageFiles files);
  ~WebParts();

  HostRules host_rules() const { return {certificate.hosts(), options.names, certificate.context() != nullptr}; }

  /// Memory limit of large bodies.
  static constexpr std::uint64_t kMaxLargeBytes = std::uint64_t{256} << 20;

  const AccessControl& access;
  AssetStore& assets;
  Traffic& traffic;
  const WebOptions options;
  const PageFiles pages;
  ServedCertificate certificate;
  const std::shared_ptr<Mailbox> mailbox = std::make_shared<Mailbox>();
  CallersBudget large_bodies{kMaxLargeBytes};
  /// Threads for slow work, and for work that waits for the disk. A slow disk blocks nothing else.
  std::shared_ptr<boost::asio::thread_pool> side = std::make_shared<boost::asio::thread_pool>(2),
                                            disk = std::make_shared<boost::asio::thread_pool>(2);
  HttpAuthenticator authenticator;
  HandshakeLog handshakes{"--http"};
  LiveHub hub;
  std::optional<boost::asio::io_context> io{1};
  std::optional<boost::asio::steady_timer> ticker, renewal;
  std::optional<JsonApi> api;
  std::unique_ptr<Listener> listener;
  std::thread thread;
};

/// Serves the connection from `peer` (ADDRESS:PORT) until it ends. Encrypted if `parts` has a certificate.
void start_http_session(WebParts& parts, boost::asio::ip::tcp::socket&& socket, const std::string& peer);

/// Answers a WebSocket upgrade, and serves the connection until it ends or `holds` returns an error.
void start_live_session(WebParts& parts, WebStream&& stream, const RequestHead& request, Call call,
                        LiveHub::Holds holds);

}  // namespace lightmill
