#include "server/web/http_body.h"

#include <boost/asio/write.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/read.hpp>

#include <string_view>
#include <utility>

namespace lightmill {

using boost::system::error_code;

void invite_body(WebStream& stream, const RequestHead& request, std::function<void()> then) {
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
