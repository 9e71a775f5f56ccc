#include "server/web/http_response.h"

#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>

#include <algorithm>
#include <array>

#include "common/base/text.h"

namespace lightmill {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

/// A connection that reads a large file more slowly is closed.
constexpr std::size_t kMinBytesPerSecond = 1 << 20;
constexpr std::string_view kPlainText = "text/plain; charset=utf-8";
/// Allows only the page's own files, no inline code, and no frames.
constexpr std::string_view kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
/// For a year, browsers use only https:// for this host.
constexpr std::string_view kAlwaysEncrypted = "max-age=31536000";

beast::string_view as_beast(std::string_view text) {
  return {text.data(), text.size()};
}

SharedBytes shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

}  // namespace

void HttpResponder::send_reply(const RequestHead& request, const ApiReply& reply, Sent sent) {
  begin(request, static_cast<http::status>(reply.status));
  response_.set(http::field::cache_control, "no-store");
  if (reply.status == static_cast<unsigned>(http::status::unauthorized)) {
    response_.set(http::field::www_authenticate, "Bearer");
  }
  if (!reply.set_cookie.empty()) {
    response_.set(http::field::set_cookie, as_beast(reply.set_cookie));
  }
  if (!reply.file_name.empty()) {
    response_.set(http::field::content_disposition, fmt::format("attachment; filename=\"{}\"", reply.file_name));
  }
  send(request, reply.content_type, reply.file == nullptr ? shared(reply.body) : reply.file, std::move(sent));
}

void HttpResponder::send_page(const RequestHead& request, const PageFiles& pages, std::string_view path, Sent sent) {
  const PageFile* const file = pages.find(path);
  if (file == nullptr) {
    return send_missing_page(request, pages, path, std::move(sent));
  }
  const bool same = as_std(request[http::field::if_none_match]) == file->etag;
  begin(request, same ? http::status::not_modified : http::status::ok);
  response_.set(http::field::etag, as_beast(file->etag));
  response_.set(http::field::vary, "Accept-Encoding");
  response_.set(http::field::cache_control, file->immutable ? "public, max-age=31536000, immutable" : "no-cache");
  const bool packed =
      file->gzip != nullptr && as_std(request[http::field::accept_encoding]).find("gzip") != std::string_view::npos;
  if (packed) {
    response_.set(http::field::content_encoding, "gzip");
  }
  send(request, file->content_type, same ? shared("") : packed ? file->gzip : file->bytes, std::move(sent));
}

/// "/docs/" leads to "/docs", where the links of that page fit. The location is relative, because a proxy may serve the
/// page below a folder.
void HttpResponder::send_missing_page(const RequestHead& request, const PageFiles& pages, std::string_view path,
                                      Sent sent) {
  const std::string_view page = path.substr(0, std::max<std::size_t>(path.size(), 1) - 1);
  const bool slash = path.ends_with('/') && pages.find(page) != nullptr;
  begin(request, slash ? http::status::permanent_redirect : http::status::not_found);
  if (slash) {
    response_.set(http::field::location, fmt::format("..{}", page.substr(page.rfind('/'))));
  }
  send(request, kPlainText, shared(fmt::format("there is no {}\n", printable(path))), std::move(sent));
}

void HttpResponder::send_to_https(const RequestHead& request, Sent sent) {
  begin(request, http::status::temporary_redirect);
  const std::string_view target = as_std(request.target());
  response_.set(http::field::location, fmt::format("https://{}{}", as_std(request[http::field::host]),
                                                   target.starts_with('/') ? target : "/"));
  send(request, kPlainText, shared("this address accepts only encrypted connections: use https://\n"), std::move(sent));
}

void HttpResponder::begin(const RequestHead& request, http::status status) {
  response_ = Response(status, request.version());
  response_.keep_alive(request.keep_alive());
  response_.set("Content-Security-Policy", as_beast(kContentPolicy));
  if (stream_.encrypted()) {
    response_.set("Strict-Transport-Security", as_beast(kAlwaysEncrypted));
  }
  response_.set("X-Content-Type-Options", "nosniff");
  response_.set("X-Frame-Options", "DENY");
  response_.set("Referrer-Policy", "no-referrer");
  response_.set("Cross-Origin-Opener-Policy", "same-origin");
  response_.set("Cross-Origin-Resource-Policy", "same-origin");
}

void HttpResponder::send(const RequestHead& request, std::string_view type, SharedBytes body, Sent sent) {
  body_ = std::move(body);
  response_.set(http::field::content_type, as_beast(type));
  response_.body() = {body_->data(), body_->size()};
  response_.prepare_payload();
  if (request.method() == http::verb::head) {
    response_.body() = {};  // a reply to HEAD has the length of the body, but no body
  }
  head_ = beast::buffers_to_string(
      Response::fields_type::writer(response_, response_.version(), response_.result_int()).get());
  stream_.tcp().expires_after(timeout_ + std::chrono::seconds(response_.body().size() / kMinBytesPerSecond));
  const std::array<asio::const_buffer, 2> parts{asio::buffer(head_),
                                                asio::buffer(response_.body().data(), response_.body().size())};
  // `sent` keeps this alive.
  asio::async_write(stream_, parts, [this, sent = std::move(sent)](boost::system::error_code error, std::size_t) {
    body_ = nullptr;
    if (!error) {
      sent(response_.keep_alive());
    }
  });
}

}  // namespace lightmill
