#include "server/listen/listen_problem.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "common/base/address.h"

namespace lightmill {
namespace {

/// 0, or the errno of binding the address.
int bind_error(const addrinfo& address) {
  const int socket = ::socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) {
    return errno;
  }
  const int yes = 1;
  (void)::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const bool bound = ::bind(socket, address.ai_addr, address.ai_addrlen) == 0 && ::listen(socket, 1) == 0;
  const int error = bound ? 0 : errno;
  ::close(socket);
  return error;
}

}  // namespace

std::string listen_problem(const std::string& listen, std::string_view option) {
  const Result<HostPort> parsed = parse_host_port(listen);
  if (!parsed.ok()) {
    return message_of(parsed.status());
  }
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(parsed->host.c_str(), std::to_string(parsed->port).c_str(), &hints, &found);
      code != 0) {
    return fmt::format("'{}' is not an address ({})", parsed->host, ::gai_strerror(code));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  int error = 0;
  for (const addrinfo* each = found; each != nullptr && error == 0; each = each->ai_next) {
    error = bind_error(*each);
  }
  switch (error) {
    case 0:
      return "the port was taken a moment ago; try again";
    case EADDRINUSE:
      return fmt::format("another program (another lightmill-server?) is using the port; choose another with {}",
                         option);
    case EADDRNOTAVAIL:
      return "this machine has no such address; 0.0.0.0 means all of its addresses";
    default:
      return std::strerror(error);
  }
}

}  // namespace lightmill
