// HTTP responses of one connection: replies of the API, files of the page, redirects. Beast writes them.
#pragma once

#include <boost/beast/http/span_body.hpp>

#include "server/web/http_body.h"
#include "server/web/http_text.h"
#include "server/web/page_files.h"

namespace lightmill {

/// Sends one response at a time, and holds it until it is sent. Each has the headers that protect the page. Not
/// thread-safe.
class HttpResponder {
 public:
  /// Called when the response is sent, unless the connection has ended.
  using Sent = std::function<void(bool keep_alive)>;

  /// `timeout`: WebOptions::timeout.
  HttpResponder(WebStream& stream, Duration timeout) : stream_(stream), timeout_(timeout) {}
  HttpResponder(const HttpResponder&) = delete;
  HttpResponder& operator=(const HttpResponder&) = delete;

  void send_reply(const RequestHead& request, const ApiReply& reply, Sent sent);
  /// `path` is looked up in `pages`.
  void send_page(const RequestHead& request, const PageFiles& pages, std::string_view path, Sent sent);
  /// Redirects an unencrypted request to https://.
  void send_to_https(const RequestHead& request, Sent sent);

 private:
  /// Does not own its body, so files are not copied.
  using Response = boost::beast::http::response<boost::beast::http::span_body<const char>>;

  void begin(const RequestHead& request, boost::beast::http::status status);
  void send(const RequestHead& request, std::string_view type, SharedBytes body, Sent sent);
  void send_missing_page(const RequestHead& request, const PageFiles& pages, std::string_view path, Sent sent);

  WebStream& stream_;
  const Duration timeout_;
  Response response_;
  SharedBytes body_;
  std::string head_;  ///< as sent
};

}  // namespace lightmill
