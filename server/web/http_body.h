// How bodies of requests are taken in: what is common to all that read one.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>

#include <chrono>
#include <string_view>
#include <utility>

#include "server/web/web_stream.h"

namespace lightmill {

using SteadyClock = std::chrono::steady_clock;

/// A request whose body is still on its way.
using RequestHead = boost::beast::http::request<boost::beast::http::empty_body>;
using HeadParser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

/// Who says nothing for so long is hung up on.
inline constexpr auto kRequestPatience = std::chrono::seconds(30);
/// Who sends a large body more slowly is, too.
inline constexpr std::uint64_t kLeastBytesPerSecondSent = std::uint64_t{128} << 10;
inline std::chrono::seconds time_to_send(std::uint64_t bytes) {
  return kRequestPatience + std::chrono::seconds(bytes / kLeastBytesPerSecondSent);
}

/// Who asks first whether it may send its body is told so; then goes on, unless the connection has ended.
template <class Then>
void invite_body(WebStream& stream, const RequestHead& request, Then then) {
  if (!boost::beast::iequals(request[boost::beast::http::field::expect], "100-continue")) {
    return then();
  }
  static constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
  boost::asio::async_write(stream, boost::asio::buffer(kGoOn.data(), kGoOn.size()),
                           [then = std::move(then)](boost::system::error_code error, std::size_t) mutable {
                             if (!error) {
                               then();
                             }
                           });
}

}  // namespace lightmill
