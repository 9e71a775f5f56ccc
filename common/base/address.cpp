#include "common/base/address.h"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>

#include "common/base/text.h"

namespace lightmill {
namespace {

bool is_host(std::string_view host) {
  return !host.empty() &&
         std::ranges::all_of(host, [](char c) { return c > ' ' && c != '/' && c != '[' && c != ']' && c != '\x7f'; });
}

}  // namespace

std::string host_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  return ::gethostname(name.data(), name.size()) == 0 ? name.data() : "unknown";
}

bool is_loopback(const std::string& host) {
  std::array<unsigned char, 4> v4{};
  if (::inet_pton(AF_INET, host.c_str(), v4.data()) == 1) {
    return v4[0] == 127;
  }
  in6_addr v6{};
  return host == "localhost" || (::inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6));
}

Result<HostPort> parse_host_port(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    return invalid_argument("'{}' must be HOST:PORT, for example 127.0.0.1:7350", text);
  }
  std::string_view host = text.substr(0, colon);
  const std::string_view port_text = text.substr(colon + 1);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != std::string_view::npos) {
    return invalid_argument("'{}' has several colons: put an IPv6 address in brackets, for example [::1]:7350", text);
  }
  if (!is_host(host)) {
    return invalid_argument("'{}' must be HOST:PORT, for example 127.0.0.1:7350", text);
  }
  const std::optional<std::uint16_t> port = parse_number<std::uint16_t>(port_text);
  if (!port) {
    return invalid_argument("the port of '{}' must be a number from 0 to 65535", text);
  }
  return HostPort{std::string(host), *port};
}

}  // namespace lightmill
