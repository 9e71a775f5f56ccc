// Helpers that all readers of HTTP request bodies share.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>

#include <chrono>
#include <functional>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/web/web_stream.h"

namespace lightmill {

using SteadyClock = std::chrono::steady_clock;

/// A request whose body is still incomplete.
using RequestHead = boost::beast::http::request<boost::beast::http::empty_body>;
using HeadParser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

/// A connection that sends a large body more slowly is closed.
inline constexpr std::uint64_t kMinBytesPerSecondSent = std::uint64_t{128} << 10;
/// `timeout`: WebOptions::timeout.
inline Duration body_timeout(Duration timeout, std::uint64_t bytes) {
  return timeout + std::chrono::seconds(bytes / kMinBytesPerSecondSent);
}

inline std::string_view as_std(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

/// INVALID_ARGUMENT if a proxy could interpret this head differently, with another host or another end of the body.
/// This prevents request smuggling (RFC 9112: 3.2, 6.1, 6.3). Beast refuses Content-Length together with chunks, and
/// different lengths.
Status check_framing(const RequestHead& request);

/// Whether the input is not HTTP. False if it is too long or incomplete.
bool is_malformed(boost::system::error_code error);

/// Answers "Expect: 100-continue" if the client sent it. Then calls `then`, unless the connection has ended.
void send_continue(WebStream& stream, const RequestHead& request, std::function<void()> then);

/// Parses what `buffer` holds, or reads until the parser makes progress. `then` gets the error.
void parse_more(WebStream& stream, boost::beast::flat_buffer& buffer, boost::beast::http::basic_parser<true>& parser,
                std::function<void(boost::system::error_code)> then);

}  // namespace lightmill
