#include "tests/integration/store/cut_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "common/base/check.h"

namespace lightmill::test {

CutProxy::CutProxy(std::string socket_file) : socket_file_(std::move(socket_file)) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  LM_CHECK(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0 && ::listen(listener_, 16) == 0);
  LM_CHECK(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  port_ = ntohs(address.sin_port);
  accepting_ = std::thread([this] { accept_all(); });
}

CutProxy::~CutProxy() {
  ::shutdown(listener_, SHUT_RDWR);
  accepting_.join();
  ::close(listener_);
  cut();
  std::vector<std::thread> relays;
  {
    const MutexLock lock(mutex_);
    relays.swap(relays_);
  }
  for (std::thread& relay : relays) {
    relay.join();
  }
  for (const int socket : sockets_) {
    ::close(socket);
  }
}

void CutProxy::cut() {
  const MutexLock lock(mutex_);
  for (const int socket : sockets_) {
    ::shutdown(socket, SHUT_RDWR);
  }
}

void CutProxy::accept_all() {
  for (;;) {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) {
      return;
    }
    const int server = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket_file_.c_str(), sizeof(address.sun_path) - 1);
    if (::connect(server, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) {
      ::close(server);
      ::close(client);
      continue;
    }
    const MutexLock lock(mutex_);
    sockets_.insert(sockets_.end(), {client, server});
    relays_.emplace_back([=, this] { relay(client, server, false); });
    relays_.emplace_back([=, this] { relay(server, client, true); });
  }
}

void CutProxy::relay(int from, int to, bool answers) {
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const ssize_t got = ::recv(from, buffer.data(), buffer.size(), 0);
    if (got <= 0) {
      break;
    }
    for (ssize_t sent = 0; sent < got && !(answers && swallowing_);) {
      const ssize_t more = ::send(to, buffer.data() + sent, static_cast<std::size_t>(got - sent), MSG_NOSIGNAL);
      if (more <= 0) {
        break;
      }
      sent += more;
    }
  }
  ::shutdown(from, SHUT_RDWR);
  ::shutdown(to, SHUT_RDWR);
}

}  // namespace lightmill::test
