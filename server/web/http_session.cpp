#include "server/web/http_session.h"

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/http/span_body.hpp>

#include "common/base/text.h"
#include "server/web/live_session.h"
#include "server/web/web_stream.h"

namespace lightmill {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::uint32_t kMostHeaderBytes = 8 << 10;
constexpr std::uint64_t kMostBodyBytes = 16 << 10;
constexpr auto kRequestPatience = std::chrono::seconds(30);
/// Who reads a large file more slowly is hung up on.
constexpr std::size_t kLeastBytesPerSecond = 1 << 20;
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
/// Its body is somebody else's: files are not copied.
using Response = http::response<http::span_body<const char>>;

RequestOrigin origin_of(const Request& request) {
  return {as_std(request[http::field::host]), as_std(request[http::field::origin]), as_std(request["Sec-Fetch-Site"])};
}

class HttpSession final : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(WebParts& parts, tcp::socket&& socket)
      : parts_(parts), stream_(std::move(socket), parts.certificate.context()) {
    ++parts_.connections;
  }
  ~HttpSession() {
    if (!handed_on_) {
      --parts_.connections;
    }
  }
  void start() {
    if (!stream_.encrypted()) {
      return read();
    }
    stream_.tcp().expires_after(kRequestPatience);
    stream_.async_handshake([self = shared_from_this()](error_code error) {
      if (!error) {
        self->read();
      }
    });
  }

 private:
  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(kMostBodyBytes);
    stream_.tcp().expires_after(kRequestPatience);
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
             shared(fmt::format("the {} has more than {} bytes\n", body ? "body" : "header",
                                body ? kMostBodyBytes : kMostHeaderBytes)));
    write(std::move(response));
  }

  void handle() {
    const Request& request = parser_->get();
    const std::string_view target = as_std(request.target());
    const std::string_view path = target.substr(0, target.find('?'));
    const bool live = path == kLive;
    const bool changes = request.method() == http::verb::post;
    const Status status = check_rules(live, changes);
    if (!status.ok()) {
      return answer(error_reply(status));
    }
    if (!path.starts_with(kApi)) {
      return send_page(path);
    }
    const ShownLogin shown = shown_login();
    if (live) {
      return go_live(shown);
    }
    if (!changes && request.method() != http::verb::get && request.method() != http::verb::head) {
      return answer(error_reply(make_error(StatusCode::kUnimplemented, "the API takes GET and POST")));
    }
    const std::string_view query = path.size() < target.size() ? target.substr(path.size() + 1) : "";
    parts_.api->handle({changes, std::string(path), std::string(query), request.body(), parts_.logins.identify(shown),
                        shown.cookie, peer(), cookie_place()},
                       [self = shared_from_this()](const ApiReply& reply) { self->answer(reply); });
  }

  /// What is asked of every request before anything else is looked at.
  Status check_rules(bool live, bool changes) const {
    const Request& request = parser_->get();
    const RequestOrigin origin = origin_of(request);
    const HostRules rules = parts_.host_rules();
    LM_RETURN_IF_ERROR(check_host(origin, rules));
    if (live || changes) {
      LM_RETURN_IF_ERROR(check_origin(origin, rules));
    }
    return changes ? check_json(as_std(request[http::field::content_type])) : ok_status();
  }
  ShownLogin shown_login() const {
    const Request& request = parser_->get();
    ShownLogin shown;
    if (const auto header = request.find(http::field::authorization); header != request.end()) {
      shown.authorization = std::string(as_std(header->value()));
    }
    shown.cookie = login_cookie(as_std(request[http::field::cookie]),
                                {std::string(as_std(request[http::field::host])), stream_.encrypted()});
    return shown;
  }
  CookiePlace cookie_place() const {
    const Request& request = parser_->get();
    return {std::string(as_std(request[http::field::host])),
            stream_.encrypted() || as_std(request[http::field::origin]).starts_with("https://")};
  }

  std::string peer() const {
    beast::error_code gone;
    const auto endpoint = stream_.tcp().socket().remote_endpoint(gone);
    return gone ? "?" : fmt::format("{}:{}", endpoint.address().to_string(), endpoint.port());
  }

  void go_live(const ShownLogin& shown) {
    if (!websocket::is_upgrade(parser_->get())) {
      return answer(error_reply(invalid_argument("{} is a WebSocket", kLive)));
    }
    if (parts_.hub.full()) {
      return answer(error_reply(resource_exhausted("{} pages are open already", LiveHub::kMostViewers)));
    }
    Result<Call> call = parts_.gate.admit(parts_.logins.identify(shown), peer(), Rpc::watch_job);
    if (!call.ok()) {
      return answer(error_reply(call.status()));
    }
    stream_.tcp().expires_never();
    handed_on_ = true;
    LiveHub::Holds holds = [&logins = parts_.logins, shown, caller = call->caller] {
      return logins.check_still_holds(shown, caller);
    };
    start_live_session(parts_, std::move(stream_), parser_->get(), *std::move(call), std::move(holds));
  }

  void send_page(std::string_view path) {
    const Request& request = parser_->get();
    const PageFile* const file = parts_.pages.find(path);
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return answer(error_reply(make_error(StatusCode::kUnimplemented, "pages are asked for by GET")));
    }
    if (file == nullptr) {
      Response response = response_of(http::status::not_found);
      set_body(response, "text/plain; charset=utf-8", shared(fmt::format("there is no {}\n", printable(path))));
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
    set_body(response, file->content_type, same ? shared("") : packed ? file->gzip : file->bytes);
    write(std::move(response));
  }

  void answer(const ApiReply& reply) {
    Response response = response_of(static_cast<http::status>(reply.status));
    response.set(http::field::cache_control, "no-store");
    if (reply.status == static_cast<unsigned>(http::status::unauthorized)) {
      response.set(http::field::www_authenticate, "Bearer");
    }
    if (!reply.set_cookie.empty()) {
      response.set(http::field::set_cookie, as_beast(reply.set_cookie));
    }
    if (!reply.file_name.empty()) {
      response.set(http::field::content_disposition, fmt::format("attachment; filename=\"{}\"", reply.file_name));
    }
    set_body(response, reply.content_type, reply.file == nullptr ? shared(reply.body) : reply.file);
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
  static SharedBytes shared(std::string text) { return std::make_shared<const std::string>(std::move(text)); }
  void set_body(Response& response, std::string_view type, SharedBytes body) {
    body_ = std::move(body);
    response.set(http::field::content_type, as_beast(type));
    response.body() = {body_->data(), body_->size()};
    response.prepare_payload();
  }
  void write(Response response) {
    // The answer to HEAD says how long a body would be, and has none.
    const bool head = parser_->get().method() == http::verb::head;
    response_ = std::move(response);
    if (head) {
      response_.body() = {};
    }
    stream_.tcp().expires_after(kRequestPatience +
                                std::chrono::seconds(response_.body().size() / kLeastBytesPerSecond));
    http::async_write(stream_, response_, [self = shared_from_this()](error_code error, std::size_t) {
      self->body_ = nullptr;
      if (!error && self->response_.keep_alive()) {
        self->read();
      } else if (!error) {
        self->stream_.async_end([self](error_code) {});
      }
    });
  }

  WebParts& parts_;
  WebStream stream_;
  beast::flat_buffer buffer_{kMostHeaderBytes + kMostBodyBytes};
  std::optional<http::request_parser<http::string_body>> parser_;
  SharedBytes body_;  ///< of the response
  Response response_;
  bool handed_on_ = false;
};

}  // namespace

void start_http_session(WebParts& parts, tcp::socket&& socket) {
  std::make_shared<HttpSession>(parts, std::move(socket))->start();
}

}  // namespace lightmill
