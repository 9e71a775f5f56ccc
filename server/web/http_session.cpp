// HTTP requests of one connection: the page's files, the API, and the upgrade to a WebSocket.

#include <boost/asio/ssl/error.hpp>
#include <boost/beast/core/detect_ssl.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include <limits>

#include "common/base/text.h"
#include "server/runtime/stream_slots.h"
#include "server/web/asset_upload.h"
#include "server/web/http_response.h"
#include "server/web/metrics.h"
#include "server/web/web_parts.h"

namespace lightmill {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::uint32_t kMaxHeaderBytes = 8 << 10;
constexpr std::uint64_t kMaxBodyBytes = 16 << 10;
constexpr auto kTlsTimeout = std::chrono::seconds(5);
/// Step in which a body reserves memory for large bodies.
constexpr std::uint64_t kHeldAtOnce = 1 << 20;
/// Limits for reading a refused body.
constexpr std::size_t kMaxThrownAway = std::size_t{64} << 20;
constexpr auto kThrowAwayTimeout = std::chrono::seconds(10);
constexpr std::string_view kApi = "/api/v1/";
constexpr std::string_view kAssets = "/api/v1/assets/";
constexpr std::string_view kJson = "application/json", kBytes = "application/octet-stream";
constexpr std::string_view kLive = "/api/v1/live";

RequestOrigin origin_of(const RequestHead& request) {
  return {as_std(request[http::field::host]), as_std(request[http::field::origin]), as_std(request["Sec-Fetch-Site"])};
}

class HttpSession final : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(WebParts& parts, tcp::socket&& socket, std::string peer)
      : parts_(parts), stream_(std::move(socket)), peer_(std::move(peer)) {}
  void start() {
    if (parts_.certificate.context() == nullptr) {
      return read();
    }
    stream_.tcp().expires_after(kTlsTimeout);
    beast::async_detect_ssl(stream_, buffer_, [self = shared_from_this()](error_code error, bool encrypts) {
      if (!error) {
        encrypts ? self->shake_hands() : self->read_unencrypted();
      }
    });
  }

 private:
  void shake_hands() {
    stream_.async_handshake(parts_.certificate.context(), buffer_.data(),
                            [self = shared_from_this()](error_code error, std::size_t used) {
                              self->buffer_.consume(used);
                              if (!error) {
                                self->read();
                              } else if (error.category() == boost::asio::error::get_ssl_category()) {
                                self->parts_.handshakes.add(self->peer_, error.message());
                              }
                            });
  }
  /// Redirects unencrypted requests to https://, and serves nothing else.
  void read_unencrypted() {
    to_https_ = true;
    read();
  }
  void point_to_https() {
    if (const Status status = check_rules(false, ""); !status.ok() || request_[http::field::host].empty()) {
      return refuse_rest(error_reply(status.ok() ? invalid_argument("use https://") : status));
    }
    request_.keep_alive(false);
    body_read_ = head_->is_done();  // there is no body
    responder_.send_to_https(request_, when_sent());
  }
  void read() {
    head_.emplace();
    head_->header_limit(kMaxHeaderBytes);
    head_->body_limit(std::numeric_limits<std::uint64_t>::max());  // the limit of the body is checked later
    body_parser_.reset();
    body_read_ = false;
    reservation_ = nullptr;
    call_.reset();
    parts_.listener->clear_caller(peer_);  // a connection with half a request holds no caller's slot
    stream_.tcp().expires_after(parts_.options.timeout);
    read_head();
  }
  void read_head() {
    parse_more(stream_, buffer_, *head_, [self = shared_from_this()](error_code error) {
      if (!error && !self->head_->is_header_done()) {
        return self->read_head();
      }
      self->request_ = self->head_->get();
      if (error == http::error::header_limit) {
        self->refuse_rest(too_long(http::status::request_header_fields_too_large, "header", kMaxHeaderBytes));
      } else if (is_malformed(error)) {
        self->refuse_malformed(error);
      } else if (const Status status = error ? ok_status() : check_framing(self->request_); !status.ok()) {
        self->refuse_rest(error_reply(status));
      } else if (!error) {
        self->take_head();
      }
    });
  }

  void take_head() {
    if (to_https_) {
      return point_to_https();
    }
    const bool post = request_.method() == http::verb::post;
    const Operation* const large = post ? find_large_operation(path()) : nullptr;
    if (large != nullptr) {
      return take_large(*large);
    }
    if (post && path().starts_with(kAssets)) {
      return take_asset();
    }
    read_body(kMaxBodyBytes);
  }
  /// Checks the caller before it reads a large body.
  void take_large(const Operation& large) {
    Result<Call> call = admit_now(large.rpc, kJson);
    if (!call.ok()) {
      return refuse_rest(error_reply(call.status()));
    }
    call_ = *std::move(call);
    read_body(large.traits.most_body_bytes);
  }
  void take_asset() {
    Result<Call> call = admit_now(kUploadAsset, kBytes);
    const Result<Sha256> digest =
        call.ok() ? Sha256::from_hex(path().substr(kAssets.size())) : Result<Sha256>(call.status());
    if (!digest.ok()) {
      return refuse_rest(error_reply(digest.status()));
    }
    call->slot->on_evict([mailbox = parts_.mailbox, weak = weak_from_this()] {
      mailbox->post([weak] {
        if (const auto self = weak.lock()) {
          self->stream_.tcp().close();
        }
      });
    });
    receive_asset(
        {stream_, buffer_, parts_.assets, parts_.access, *parts_.disk, parts_.traffic, parts_.options.timeout},
        std::move(*head_), *digest, *std::move(call), [self = shared_from_this()](const Status& status, bool whole) {
          const ApiReply reply = status.ok() ? ApiReply{200, "application/json", "{}\n"} : error_reply(status);
          self->body_read_ = whole;
          return whole ? self->answer(reply) : self->refuse_rest(reply);
        });
  }
  Result<Call> admit_now(const Rpc& rpc, std::string_view content_type) const {
    LM_RETURN_IF_ERROR(check_rules(true, content_type));
    return parts_.access.admit(identify(read_credentials()), peer_, rpc);
  }
  void read_body(std::uint64_t most_bytes) {
    if (head_->content_length().value_or(0) > most_bytes) {
      return refuse_rest(too_long(http::status::payload_too_large, "body", most_bytes));
    }
    body_parser_.emplace(std::move(*head_)).body_limit(most_bytes);
    body_began_ = SteadyClock::now();
    held_bytes_ = kMaxBodyBytes;
    send_continue(stream_, request_, [self = shared_from_this(), most_bytes] { self->read_more(most_bytes); });
  }
  /// Reads in pieces. A silent sender does not keep memory or a connection for long.
  void read_more(std::uint64_t most_bytes) {
    if (body_parser_->is_done()) {
      return handle();
    }
    const std::uint64_t there = body_parser_->get().body().size();
    if (std::min(there + kMaxBodyBytes, most_bytes) > held_bytes_) {
      ByteBudget::Reservation more =
          parts_.large_bodies.take(holder_of(call_->caller, call_->peer), kHeldAtOnce, reservation_);
      if (more == nullptr) {
        body_parser_.reset();  // its memory is free for others now
        reservation_ = nullptr;
        return refuse_rest(error_reply(resource_exhausted("the farm receives too much data at once: try again")));
      }
      reservation_ = std::move(more);
      held_bytes_ += kHeldAtOnce;
    }
    stream_.tcp().expires_at(std::min(body_began_ + body_timeout(parts_.options.timeout, there),
                                      SteadyClock::now() + parts_.options.timeout));
    parse_more(stream_, buffer_, *body_parser_, [self = shared_from_this(), most_bytes](error_code error) {
      if (error == http::error::body_limit) {
        self->refuse_rest(too_long(http::status::payload_too_large, "body", most_bytes));
      } else if (is_malformed(error)) {
        self->refuse_malformed(error);
      } else if (!error) {
        self->read_more(most_bytes);
      }
    });
  }
  static ApiReply too_long(http::status status, std::string_view what, std::uint64_t most_bytes) {
    return {static_cast<unsigned>(status), "text/plain; charset=utf-8",
            fmt::format("the {} has more than {} bytes\n", what, most_bytes)};
  }
  void refuse_malformed(error_code error) {
    refuse_rest(error_reply(invalid_argument("the request is not HTTP/1.1: {}", error.message())));
  }
  /// Ends the connection after the reply, because the rest of the input is not understood.
  void refuse_rest(const ApiReply& reply) {
    request_.keep_alive(false);
    answer(reply);
  }

  std::string_view path() const {
    const std::string_view target = as_std(request_.target());
    return target.substr(0, target.find('?'));
  }
  void handle() {
    body_read_ = true;
    const bool live = path() == kLive;
    const bool changes = request_.method() == http::verb::post;
    const Status status = check_rules(live || changes, changes ? kJson : "");
    if (!status.ok()) {
      return answer(error_reply(status));
    }
    if (!path().starts_with(kApi) && path() != kMetricsPath) {
      return send_page(path());
    }
    const HttpCredentials credentials = read_credentials();
    if (live) {
      return go_live(credentials);
    }
    if (!changes && request_.method() != http::verb::get && request_.method() != http::verb::head) {
      return answer(error_reply(make_error(StatusCode::kUnimplemented, "the API accepts GET and POST")));
    }
    const std::string_view target = as_std(request_.target());
    const std::string_view query = path().size() < target.size() ? target.substr(path().size() + 1) : "";
    parts_.api->handle({changes,
                        std::string(path()),
                        std::string(query),
                        {std::move(body_parser_->get().body()), std::move(reservation_)},
                        std::move(call_),
                        identify(credentials),
                        credentials.cookie,
                        peer_,
                        cookie_scope()},
                       [self = shared_from_this()](const ApiReply& reply) { self->answer(reply); });
  }

  /// Checks of every request, before anything else. `content_type`: required type of the body.
  Status check_rules(bool from_here, std::string_view content_type) const {
    const RequestOrigin origin = origin_of(request_);
    const HostRules rules = parts_.host_rules();
    LM_RETURN_IF_ERROR(check_host(origin, rules));
    if (from_here) {
      LM_RETURN_IF_ERROR(check_origin(origin, rules));
    }
    return content_type.empty() ? ok_status()
                                : check_content_type(as_std(request_[http::field::content_type]), content_type);
  }
  HttpCredentials read_credentials() const {
    HttpCredentials credentials;
    if (const auto header = request_.find(http::field::authorization); header != request_.end()) {
      credentials.authorization = std::string(as_std(header->value()));
    }
    credentials.cookie = login_cookie(as_std(request_[http::field::cookie]),
                                      {std::string(as_std(request_[http::field::host])), stream_.encrypted()});
    return credentials;
  }
  CookieScope cookie_scope() const {
    return {std::string(as_std(request_[http::field::host])),
            stream_.encrypted() || as_std(request_[http::field::origin]).starts_with("https://")};
  }

  /// Identifies the caller. The connection is known afterwards, unless the caller has its share of connections.
  Result<Identity> identify(const HttpCredentials& credentials) const {
    LM_ASSIGN_OR_RETURN(Identity caller, parts_.authenticator.identify(credentials));
    parts_.listener->set_caller(peer_, caller).IgnoreError();
    return caller;
  }

  void go_live(const HttpCredentials& credentials) {
    if (!websocket::is_upgrade(request_)) {
      return answer(error_reply(invalid_argument("{} is a WebSocket", kLive)));
    }
    Result<Call> call = parts_.access.admit_page(identify(credentials), peer_);
    if (!call.ok()) {
      return answer(error_reply(call.status()));
    }
    stream_.tcp().expires_never();
    LiveHub::Holds holds = [&authenticator = parts_.authenticator, credentials, caller = call->caller] {
      return authenticator.check_still_holds(credentials, caller);
    };
    start_live_session(parts_, std::move(stream_), request_, *std::move(call), std::move(holds));
  }

  void send_page(std::string_view path) {
    if (request_.method() != http::verb::get && request_.method() != http::verb::head) {
      return answer(error_reply(make_error(StatusCode::kUnimplemented, "pages must be requested with GET")));
    }
    responder_.send_page(request_, parts_.pages, path, when_sent());
  }

  void answer(const ApiReply& reply) {
    parts_.traffic.answers_out += reply.file == nullptr ? reply.body.size() : reply.file->size();
    responder_.send_reply(request_, reply, when_sent());
  }

  HttpResponder::Sent when_sent() {
    return [self = shared_from_this()](bool keep_alive) {
      if (keep_alive) {
        return self->read();
      }
      self->stream_.tcp().expires_after(kThrowAwayTimeout);
      self->throw_away(kMaxThrownAway);
    };
  }
  /// Reads the rest of the request for a while. If the connection closed while the client sends, the client might not
  /// see the reply.
  void throw_away(std::size_t most_bytes) {
    if (most_bytes == 0 || body_read_) {
      return stream_.async_end([self = shared_from_this()](error_code) {});
    }
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(std::min(buffer_.max_size(), most_bytes)),
                            [self = shared_from_this(), most_bytes](error_code error, std::size_t got) {
                              self->throw_away(error ? 0 : most_bytes - got);
                            });
  }

  WebParts& parts_;
  WebStream stream_;
  HttpResponder responder_{stream_, parts_.options.timeout};
  const std::string peer_;  ///< ADDRESS:PORT
  beast::flat_buffer buffer_{kMaxHeaderBytes + kMaxBodyBytes};
  std::optional<HeadParser> head_;
  RequestHead request_;
  std::optional<http::request_parser<http::string_body>> body_parser_;
  bool body_read_ = false;
  SteadyClock::time_point body_began_;
  std::uint64_t held_bytes_ = 0;         ///< of its body: bytes that may arrive before the next reservation
  ByteBudget::Reservation reservation_;  ///< of its body, if it is large
  std::optional<Call> call_;             ///< if it was admitted before its body arrived, as with large bodies
  bool to_https_ = false;                ///< an unencrypted request to an encrypted server
};

}  // namespace

void start_http_session(WebParts& parts, tcp::socket&& socket, const std::string& peer) {
  std::make_shared<HttpSession>(parts, std::move(socket), peer)->start();
}

}  // namespace lightmill
