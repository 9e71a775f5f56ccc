// Network addresses as people write them: HOST:PORT.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

struct HostPort {
  std::string host;  ///< without the brackets of an IPv6 address
  std::uint16_t port = 0;
};

/// Whether a HostPort's host is this machine as only its own programs reach it: 127.0.0.0/8, ::1 or localhost.
bool is_loopback(const std::string& host);

/// Reads `farm.example:7350`, `127.0.0.1:7350` or `[::1]:7350`. INVALID_ARGUMENT says what is wrong with it; whether
/// port 0 makes sense is the caller's to say.
Result<HostPort> parse_host_port(std::string_view text);

}  // namespace lightmill
