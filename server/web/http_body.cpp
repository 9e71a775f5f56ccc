#include "server/web/http_body.h"

#include <boost/asio/write.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/read.hpp>

#include <utility>

#include "common/base/text.h"
#include "server/web/request_rules.h"

namespace lightmill {

namespace http = boost::beast::http;
using boost::system::error_code;

Status check_framing(const RequestHead& request) {
  if (request.count(http::field::host) > 1 || (request.version() >= 11 && request.count(http::field::host) == 0)) {
    return invalid_argument("Host: a request has exactly one, this one has {}", request.count(http::field::host));
  }
  if (const std::string_view host = as_std(request[http::field::host]);
      request.count(http::field::host) > 0 && !is_host(host)) {
    return invalid_argument("Host: '{}' is not HOST or HOST:PORT", printable(host));
  }
  if (request.count(http::field::content_length) > 1) {
    return invalid_argument("Content-Length: a request has at most one, this one has {}",
                            request.count(http::field::content_length));
  }
  const auto coding = request.find(http::field::transfer_encoding);
  if (coding != request.end() &&
      (request.version() < 11 || request.count(http::field::transfer_encoding) > 1 ||
       request.count(http::field::content_length) > 0 || !boost::beast::iequals(coding->value(), "chunked"))) {
    return invalid_argument("Transfer-Encoding: must be one 'chunked', in HTTP/1.1, without Content-Length");
  }
  return ok_status();
}

bool is_malformed(error_code error) {
  return error && error.category() == http::make_error_code(http::error::bad_method).category() &&
         error != http::error::end_of_stream && error != http::error::partial_message &&
         error != http::error::need_more && error != http::error::need_buffer;
}

void send_continue(WebStream& stream, const RequestHead& request, std::function<void()> then) {
  if (!boost::beast::iequals(request[boost::beast::http::field::expect], "100-continue")) {
    return then();
  }
  static constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
  boost::asio::async_write(stream, boost::asio::buffer(kGoOn.data(), kGoOn.size()),
                           [then = std::move(then)](error_code error, std::size_t) {
                             if (!error) {
                               then();
                             }
                           });
}

void parse_more(WebStream& stream, boost::beast::flat_buffer& buffer, boost::beast::http::basic_parser<true>& parser,
                std::function<void(error_code)> then) {
  boost::beast::http::async_read_some(stream, buffer, parser,
                                      [then = std::move(then)](error_code error, std::size_t) { then(error); });
}

}  // namespace lightmill
