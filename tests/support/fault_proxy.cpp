#include "tests/support/fault_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <deque>
#include <random>

#include "common/base/address.h"
#include "common/base/check.h"

namespace lightmill::test {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kMaxOnTheWay = 4 << 20;  // bytes; then it reads no more from the sender
constexpr int kLookEveryMs = 5;

struct Piece {
  SteadyClock::time_point arrives;
  std::string bytes;
};

bool send_all(int to, const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t more = ::send(to, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (more <= 0) {
      return false;
    }
    sent += static_cast<std::size_t>(more);
  }
  return true;
}

sockaddr_in to_address(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  LM_CHECK(::inet_pton(AF_INET, host.c_str(), &address.sin_addr) == 1);
  return address;
}

}  // namespace

FaultProxy::FaultProxy(std::string target) : target_(std::move(target)) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = to_address("127.0.0.1", 0);
  socklen_t size = sizeof(address);
  LM_CHECK(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0 && ::listen(listener_, 16) == 0);
  LM_CHECK(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  port_ = ntohs(address.sin_port);
  accepting_ = std::thread([this] { accept_all(); });
}

FaultProxy::~FaultProxy() {
  ends_ = true;
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

void FaultProxy::delay(Way way, std::chrono::milliseconds least, std::chrono::milliseconds most) {
  direction(way).least_ms = static_cast<int>(least.count());
  direction(way).most_ms = static_cast<int>(most.count());
}

void FaultProxy::cut() {
  const MutexLock lock(mutex_);
  for (const int socket : sockets_) {
    ::shutdown(socket, SHUT_RDWR);
  }
}

int FaultProxy::connect_target() const {
  int server = -1;
  if (const Result<HostPort> address = parse_host_port(target_); address.ok()) {
    server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in to = to_address(address->host, address->port);
    if (::connect(server, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) {
      return server;
    }
  } else {
    server = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    std::strncpy(to.sun_path, target_.c_str(), sizeof(to.sun_path) - 1);
    if (::connect(server, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) {
      return server;
    }
  }
  ::close(server);
  return -1;
}

void FaultProxy::accept_all() {
  for (std::uint64_t count = 0;; ++count) {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) {
      return;
    }
    const bool refused = refuses_;
    times_refused_ += refused ? 1 : 0;
    const int server = refused ? -1 : connect_target();
    if (server < 0) {
      ::close(client);
      continue;
    }
    for (const int socket : {client, server}) {
      const int on = 1;
      (void)::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));  // fails for a local socket
    }
    const MutexLock lock(mutex_);
    sockets_.insert(sockets_.end(), {client, server});
    relays_.emplace_back([=, this] { relay(client, server, direction(Way::there), 2 * count); });
    relays_.emplace_back([=, this] { relay(server, client, direction(Way::back), 2 * count + 1); });
  }
}

/// Returns when either side closes. Bytes sent before that still arrive, unless the connection stalls.
void FaultProxy::relay(int from, int to, const Direction& direction, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::deque<Piece> on_the_way;
  std::size_t bytes = 0;
  std::string buffer(1 << 16, '\0');
  bool said_all = false, broken = false;
  while (!broken && !ends_ && (!said_all || (!on_the_way.empty() && !direction.stalls))) {
    pollfd ready{from, static_cast<short>(said_all || bytes >= kMaxOnTheWay ? 0 : POLLIN), 0};
    (void)::poll(&ready, 1, on_the_way.empty() && !said_all ? 10 * kLookEveryMs : kLookEveryMs);
    if ((ready.revents & POLLIN) != 0) {
      const ssize_t got = ::recv(from, buffer.data(), buffer.size(), 0);
      said_all = got <= 0;
      if (got > 0 && !direction.swallows) {
        const int least = direction.least_ms, most = direction.most_ms;
        const auto later =
            std::chrono::milliseconds(std::uniform_int_distribution(least, std::max(least, most))(random));
        on_the_way.push_back({SteadyClock::now() + later, buffer.substr(0, static_cast<std::size_t>(got))});
        bytes += static_cast<std::size_t>(got);
      }
    } else if ((ready.revents & (POLLHUP | POLLERR)) != 0) {
      said_all = true;
    }
    while (!broken && !direction.stalls && !on_the_way.empty() && on_the_way.front().arrives <= SteadyClock::now()) {
      broken = !send_all(to, on_the_way.front().bytes);
      bytes -= on_the_way.front().bytes.size();
      on_the_way.pop_front();
    }
  }
  ::shutdown(from, SHUT_RDWR);
  ::shutdown(to, SHUT_RDWR);
}

}  // namespace lightmill::test
