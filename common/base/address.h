// Network addresses as people write them, HOST:PORT, and the name of this host.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Name of this machine, as the system gives it.
std::string host_name();

struct HostPort {
  std::string host;  ///< without the brackets of an IPv6 address
  std::uint16_t port = 0;
};

/// Whether `host` is this machine's loopback address: 127.0.0.0/8, ::1 or localhost.
bool is_loopback(const std::string& host);

/// Reads `farm.example:7350`, `127.0.0.1:7350` or `[::1]:7350`. INVALID_ARGUMENT says what is wrong. Port 0 is
/// accepted: the caller decides whether it makes sense.
Result<HostPort> parse_host_port(std::string_view text);

}  // namespace lightmill
