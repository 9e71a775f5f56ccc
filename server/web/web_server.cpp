#include "server/web/web_server.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <optional>
#include <thread>

#include "common/base/address.h"
#include "common/base/log.h"
#include "common/base/mutex.h"
#include "common/base/text.h"
#include "server/web/json_api.h"
#include "server/web/live_hub.h"
#include "server/web/page_files.h"
#include "server/web/request_rules.h"

namespace lightmill {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 1'024;
constexpr std::uint32_t kMostHeaderBytes = 8 << 10;
constexpr std::uint64_t kMostBodyBytes = 16 << 10;
constexpr std::size_t kMostViewRequestBytes = 4 << 10;
constexpr std::size_t kWriteBufferBytes = 64 << 10;
constexpr auto kRequestPatience = std::chrono::seconds(30);
constexpr auto kLivePatience = std::chrono::seconds(30);
constexpr auto kAcceptPause = std::chrono::milliseconds(100);
constexpr std::string_view kApi = "/api/v1/";
constexpr std::string_view kLive = "/api/v1/live";
/// Nothing from elsewhere, nothing inline, in nobody's frame.
constexpr std::string_view kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view as_std(beast::string_view text) {
  return {text.data(), text.size()};
}
beast::string_view as_beast(std::string_view text) {
  return {text.data(), text.size()};
}

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

RequestOrigin origin_of(const Request& request) {
  return {as_std(request[http::field::host]), as_std(request[http::field::origin]), as_std(request["Sec-Fetch-Site"])};
}

/// Where others leave tasks for the web's thread, also when it is gone.
struct Mailbox {
  Mutex mutex;
  asio::io_context* io LM_GUARDED_BY(mutex) = nullptr;

  void post(std::function<void()> task) {
    const MutexLock lock(mutex);
    if (io != nullptr) {
      asio::post(*io, std::move(task));
    }
  }
  void set(asio::io_context* to) {
    const MutexLock lock(mutex);
    io = to;
  }
};

}  // namespace

/// All of it belongs to the thread that runs `io`, but for the mailbox.
struct WebParts {
  WebParts(FarmLoop& loop, const WebOptions& web, PageFiles files);
  ~WebParts();

  const WebOptions options;
  const PageFiles pages;
  const std::shared_ptr<Mailbox> mailbox = std::make_shared<Mailbox>();
  std::size_t connections = 0;
  LiveHub hub;
  std::optional<asio::io_context> io{1};
  std::optional<tcp::acceptor> acceptor;
  std::optional<asio::steady_timer> ticker, pause;
  std::optional<JsonApi> api;
  std::thread thread;
};

namespace {

OnWebThread posting_to(const std::shared_ptr<Mailbox>& mailbox) {
  return [mailbox](std::function<void()> task) { mailbox->post(std::move(task)); };
}

FarmGreeting greeting_of(const WebOptions& options) {
  return {options.version, options.notices, ""};
}

// ---- one viewer's WebSocket ----

class LiveSession final : public LiveLink, public std::enable_shared_from_this<LiveSession> {
 public:
  LiveSession(WebParts& parts, beast::tcp_stream&& stream, Identity caller)
      : parts_(parts), stream_(std::move(stream)), caller_(std::move(caller)) {}
  ~LiveSession() override {
    if (joined_) {
      parts_.hub.remove(*this);
    }
    --parts_.connections;
  }

  void start(const Request& request) {
    stream_.set_option(websocket::stream_base::timeout{kRequestPatience, kLivePatience, true});
    stream_.auto_fragment(false);
    stream_.write_buffer_bytes(kWriteBufferBytes);
    stream_.read_message_max(kMostViewRequestBytes);
    stream_.binary(true);
    stream_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) {
        self->parts_.hub.add(*self, self->caller_);
        self->joined_ = true;
        self->read();
      }
    });
  }

  bool busy() const override { return !writing_.empty() || closing_; }
  void send(MessageParts parts) override {
    writing_ = std::move(parts);
    std::vector<asio::const_buffer> buffers;
    for (const SharedBytes& part : writing_) {
      buffers.emplace_back(part->data(), part->size());
    }
    stream_.async_write(buffers, [self = shared_from_this()](error_code error, std::size_t) {
      self->writing_.clear();
      if (!error) {
        self->parts_.hub.written(*self);
      }
    });
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) {
        self->closing_ = true;
        return;
      }
      const auto bytes = self->buffer_.cdata();
      const Status status =
          self->parts_.hub.ask(*self, std::string_view(static_cast<const char*>(bytes.data()), bytes.size()));
      self->buffer_.clear();
      if (status.ok()) {
        self->read();
      } else {
        self->close(status);
      }
    });
  }
  void close(const Status& why) {
    spdlog::info("a viewer is sent away: {}", message_of(why));
    closing_ = true;
    const std::string reason = message_of(why).substr(0, 100);
    stream_.async_close(websocket::close_reason(websocket::close_code::policy_error, reason),
                        [self = shared_from_this()](error_code) {});
  }

  WebParts& parts_;
  websocket::stream<beast::tcp_stream> stream_;
  const Identity caller_;
  beast::flat_static_buffer<kMostViewRequestBytes> buffer_;
  MessageParts writing_;
  bool joined_ = false, closing_ = false;
};

// ---- one connection's requests ----

class HttpSession final : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(WebParts& parts, tcp::socket&& socket) : parts_(parts), stream_(std::move(socket)) {
    ++parts_.connections;
  }
  ~HttpSession() {
    if (!handed_on_) {
      --parts_.connections;
    }
  }
  void start() { read(); }

 private:
  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(kMostBodyBytes);
    stream_.expires_after(kRequestPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error == http::error::body_limit || error == http::error::header_limit) {
        self->refuse_rest(error);
      } else if (!error) {
        self->handle();
      }
    });
  }
  /// What follows on the connection is not understood any more.
  void refuse_rest(error_code error) {
    parser_->get().keep_alive(false);
    const bool body = error == http::error::body_limit;
    Response response =
        response_of(body ? http::status::payload_too_large : http::status::request_header_fields_too_large);
    response.keep_alive(false);
    set_body(response, "text/plain; charset=utf-8",
             fmt::format("the {} has more than {} bytes\n", body ? "body" : "header",
                         body ? kMostBodyBytes : kMostHeaderBytes));
    write(std::move(response));
  }

  void handle() {
    const Request& request = parser_->get();
    const std::string_view target = as_std(request.target());
    const std::string_view path = target.substr(0, target.find('?'));
    const bool live = path == kLive;
    const bool changes = request.method() == http::verb::post;
    Status status = check_host(origin_of(request));
    if (status.ok() && (live || changes)) {
      status = check_origin(origin_of(request));
    }
    if (status.ok() && changes) {
      status = check_json(as_std(request[http::field::content_type]));
    }
    if (!status.ok()) {
      return answer(error_reply(status));
    }
    if (!path.starts_with(kApi)) {
      return send_page(path);
    }
    Result<Identity> caller = parts_.options.identify(as_std(request[http::field::authorization]));
    if (!caller.ok()) {
      return answer(error_reply(caller.status()));
    }
    if (live) {
      return go_live(*caller);
    }
    if (!changes && request.method() != http::verb::get && request.method() != http::verb::head) {
      return answer(error_reply(make_error(StatusCode::kUnimplemented, "the API takes GET and POST")));
    }
    const std::string_view query = path.size() < target.size() ? target.substr(path.size() + 1) : "";
    parts_.api->handle({changes, std::string(path), std::string(query), request.body(), *std::move(caller), peer()},
                       [self = shared_from_this()](const ApiReply& reply) { self->answer(reply); });
  }

  std::string peer() const {
    beast::error_code gone;
    const auto endpoint = stream_.socket().remote_endpoint(gone);
    return gone ? "?" : fmt::format("{}:{}", endpoint.address().to_string(), endpoint.port());
  }

  void go_live(const Identity& caller) {
    if (!websocket::is_upgrade(parser_->get())) {
      return answer(error_reply(invalid_argument("{} is a WebSocket", kLive)));
    }
    if (parts_.hub.full()) {
      return answer(error_reply(resource_exhausted("{} pages are open already", LiveHub::kMostViewers)));
    }
    stream_.expires_never();
    handed_on_ = true;
    std::make_shared<LiveSession>(parts_, std::move(stream_), caller)->start(parser_->get());
  }

  void send_page(std::string_view path) {
    const Request& request = parser_->get();
    const PageFile* const file = parts_.pages.find(path);
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return answer(error_reply(make_error(StatusCode::kUnimplemented, "pages are asked for by GET")));
    }
    if (file == nullptr) {
      Response response = response_of(http::status::not_found);
      set_body(response, "text/plain; charset=utf-8", fmt::format("there is no {}\n", printable(path)));
      return write(std::move(response));
    }
    const bool same = as_std(request[http::field::if_none_match]) == file->etag;
    Response response = response_of(same ? http::status::not_modified : http::status::ok);
    response.set(http::field::etag, as_beast(file->etag));
    response.set(http::field::vary, "Accept-Encoding");
    response.set(http::field::cache_control, file->immutable ? "public, max-age=31536000, immutable" : "no-cache");
    const bool packed =
        file->gzip != nullptr && as_std(request[http::field::accept_encoding]).find("gzip") != std::string_view::npos;
    if (packed) {
      response.set(http::field::content_encoding, "gzip");
    }
    set_body(response, file->content_type, same ? std::string() : packed ? *file->gzip : *file->bytes);
    write(std::move(response));
  }

  void answer(const ApiReply& reply) {
    Response response = response_of(static_cast<http::status>(reply.status));
    response.set(http::field::cache_control, "no-store");
    set_body(response, reply.content_type, reply.body);
    write(std::move(response));
  }

  Response response_of(http::status status) const {
    Response response(status, parser_->get().version());
    response.keep_alive(parser_->get().keep_alive());
    response.set("Content-Security-Policy", as_beast(kContentPolicy));
    response.set("X-Content-Type-Options", "nosniff");
    response.set("X-Frame-Options", "DENY");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    return response;
  }
  static void set_body(Response& response, std::string_view type, std::string body) {
    response.set(http::field::content_type, as_beast(type));
    response.body() = std::move(body);
    response.prepare_payload();
  }
  void write(Response response) {
    // The answer to HEAD says how long a body would be, and has none.
    const bool head = parser_->get().method() == http::verb::head;
    response_ = std::move(response);
    if (head) {
      response_.body().clear();
    }
    stream_.expires_after(kRequestPatience);
    http::async_write(stream_, response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error && self->response_.keep_alive()) {
        self->read();
      } else {
        error_code ignored;
        self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      }
    });
  }

  WebParts& parts_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMostHeaderBytes + kMostBodyBytes};
  std::optional<http::request_parser<http::string_body>> parser_;
  Response response_;
  bool handed_on_ = false;
};

void accept_next(WebParts& parts) {
  parts.acceptor->async_accept([&parts](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) {
      return;
    }
    if (error) {  // as when there are too many open files: at once it would be the same again
      parts.pause->expires_after(kAcceptPause);
      parts.pause->async_wait([&parts](error_code ended) {
        if (!ended) {
          accept_next(parts);
        }
      });
      return;
    }
    if (parts.connections < kMostConnections) {
      socket.set_option(tcp::no_delay(true), error);
      std::make_shared<HttpSession>(parts, std::move(socket))->start();
    }
    accept_next(parts);
  });
}

void tick_on(WebParts& parts) {
  parts.ticker->expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(LiveHub::kTick));
  parts.ticker->async_wait([&parts](error_code error) {
    if (!error) {
      parts.hub.tick();
      tick_on(parts);
    }
  });
}

Status listen_on(tcp::acceptor& acceptor, const HostPort& listen) {
  error_code error;
  const std::string host = listen.host == "localhost" ? "127.0.0.1" : listen.host;
  const tcp::endpoint endpoint(asio::ip::make_address(host, error), listen.port);
  for (const auto& step : std::initializer_list<std::function<void()>>{
           [&] { acceptor.open(endpoint.protocol(), error); },
           [&] { acceptor.set_option(tcp::acceptor::reuse_address(true), error); },
           [&] { acceptor.bind(endpoint, error); }, [&] { acceptor.listen(128, error); }}) {
    if (!error) {
      step();
    }
  }
  return error ? unavailable("{}", error.message()) : ok_status();
}

}  // namespace

Result<std::unique_ptr<WebServer>> WebServer::start(FarmLoop& loop, const WebOptions& options) {
  LM_ASSIGN_OR_RETURN(const HostPort listen, parse_host_port(options.listen));
  if (!is_loopback(listen.host)) {
    return invalid_argument("{}: the page is served to this machine alone, at 127.0.0.1 or [::1]", options.listen);
  }
  Result<PageFiles> pages = PageFiles::load(options.pages);
  if (!pages.ok()) {
    spdlog::warn("the API is served without the page: {}", message_of(pages.status()));
    pages = PageFiles();
  }
  auto parts = std::make_unique<WebParts>(loop, options, *std::move(pages));
  LM_RETURN_IF_ERROR(
      with_context(listen_on(*parts->acceptor, listen), fmt::format("cannot listen on {}", options.listen)));
  accept_next(*parts);
  tick_on(*parts);
  parts->thread = std::thread([io = &*parts->io] { io->run(); });
  return std::unique_ptr<WebServer>(new WebServer(std::move(parts)));
}

WebParts::WebParts(FarmLoop& loop, const WebOptions& web, PageFiles files)
    : options(web),
      pages(std::move(files)),
      hub(loop, greeting_of(options), posting_to(mailbox), system_clock()),
      acceptor(*io),
      ticker(*io),
      pause(*io),
      api(std::in_place, loop, greeting_of(options), posting_to(mailbox)) {
  mailbox->set(&*io);
}

/// Connections die with what waits for them: replies of the API, or `io`.
WebParts::~WebParts() {
  mailbox->set(nullptr);
  io->stop();
  if (thread.joinable()) {
    thread.join();
  }
  api.reset();
  ticker.reset();
  pause.reset();
  acceptor.reset();
  io.reset();
}

WebServer::WebServer(std::unique_ptr<WebParts> parts) : parts_(std::move(parts)) {}

WebServer::~WebServer() = default;

int WebServer::port() const {
  return parts_->acceptor->local_endpoint().port();
}

}  // namespace lightmill
