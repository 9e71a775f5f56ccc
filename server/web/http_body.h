// How bodies of requests are taken in: what is common to all that read one.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>

#include <chrono>
#include <functional>

#include "common/base/status.h"
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

/// INVALID_ARGUMENT if a proxy in front of this server might read another host, or another end of the body, from the
/// head (RFC 9112: 3.2, 6.1, 6.3). Beast refuses Content-Length beside chunks, and lengths that differ.
Status check_framing(const RequestHead& request);

/// Whether what came is no HTTP, and not just too long or not all.
bool is_malformed(boost::system::error_code error);

/// Who asks first whether it may send its body is told so; then goes on, unless the connection has ended.
void invite_body(WebStream& stream, const RequestHead& request, std::function<void()> then);

/// Lets the parser take what `buffer` holds, or reads until it makes progress. `then` gets the error of either.
void parse_more(WebStream& stream, boost::beast::flat_buffer& buffer, boost::beast::http::basic_parser<true>& parser,
                std::function<void(boost::system::error_code)> then);

}  // namespace lightmill
