#include "server/listen/listener.h"

#include <arpa/inet.h>
#include <linux/tcp.h>  // libc's tcp_info has no tcpi_bytes_received
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/address.h"
#include "common/base/log.h"

namespace lightmill {
namespace {

constexpr int kBacklog = 4'096;
/// A peer that acknowledges nothing for this time is dead.
constexpr int kUserTimeoutMs = 30'000;
/// Poll interval after accept has failed, and while connections wait.
constexpr int kPauseMs = 50;
/// Poll interval while bytes of unknown connections are counted.
constexpr int kCountMs = 50;
/// Interval at which unread bytes of known connections are counted, and the time for each of them, if that is longer. A
/// local program sends a gigabyte a second, and must be noticed long before --wire-gib is full.
constexpr int kCountUnreadMs = 50;
constexpr Duration kCountUnread = std::chrono::milliseconds(kCountUnreadMs);
constexpr Duration kCountUnreadOfOne = std::chrono::microseconds(100);
/// Poll interval otherwise. Closed connections are dropped at this rate.
constexpr int kIdleMs = 5'000;
constexpr Duration kIdlePause = std::chrono::milliseconds(kIdleMs);
constexpr Duration kSweepPause = std::chrono::milliseconds(100);
constexpr Duration kTellPause = std::chrono::minutes(1);
/// Connections accepted before other work is done.
constexpr int kAcceptedAtOnce = 64;

using AddressInfo = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// The error text says why the host has no address.
Result<AddressInfo> resolve(const HostPort& at) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(at.host.c_str(), std::to_string(at.port).c_str(), &hints, &found); code != 0) {
    return unavailable("'{}' is not an address ({})", at.host, ::gai_strerror(code));
  }
  return AddressInfo(found, &::freeaddrinfo);
}

int port_of(const sockaddr_storage& address) {
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

/// ADDRESS:PORT, equal to gRPC's text for the same connection.
std::string text_of(const sockaddr_storage& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.ss_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(address).sin_addr, text.data(), text.size());
    return fmt::format("{}:{}", text.data(), port_of(address));
  }
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
    ::inet_ntop(AF_INET, v6.sin6_addr.s6_addr + 12, text.data(), text.size());
    return fmt::format("{}:{}", text.data(), port_of(address));
  }
  ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  const std::string scope = v6.sin6_scope_id == 0 ? "" : fmt::format("%{}", v6.sin6_scope_id);
  return fmt::format("[{}{}]:{}", text.data(), scope, port_of(address));
}

void set_option(int socket, int level, int option, int value) {
  (void)::setsockopt(socket, level, option, &value, sizeof value);
}

/// A listening socket, or -errno if the address cannot be bound. Accepted sockets inherit its options.
int listen_at(const sockaddr* address, socklen_t size) {
  const int socket = ::socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) {
    return -errno;
  }
  set_option(socket, SOL_SOCKET, SO_REUSEADDR, 1);
  set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeoutMs);
  if (address->sa_family == AF_INET6) {
    set_option(socket, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  }
  if (::bind(socket, address, size) != 0 || ::listen(socket, kBacklog) != 0) {
    const int error = errno;
    ::close(socket);
    return -error;
  }
  return socket;
}

sockaddr_storage local_address(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  (void)::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  return address;
}

/// A socket for all addresses of the machine, of both families if it has them. Negative on failure.
int listen_everywhere(int port) {
  sockaddr_in6 any{};
  any.sin6_family = AF_INET6;
  any.sin6_addr = in6addr_any;
  any.sin6_port = htons(static_cast<std::uint16_t>(port));
  return listen_at(reinterpret_cast<const sockaddr*>(&any), sizeof any);
}

/// Why the address cannot be bound. `option` gave it.
std::string bind_problem(int error, std::string_view option) {
  switch (error) {
    case EADDRINUSE:
      return fmt::format("another program (another lightmill-server?) is using the port. Choose another with {}",
                         option);
    case EADDRNOTAVAIL:
      return "this machine has no such address. 0.0.0.0 means all of its addresses";
    default:
      return std::strerror(error);
  }
}

/// Sockets for all addresses of a host, with the same port. UNAVAILABLE if none can be bound, with the first error.
Result<std::vector<int>> listen_on(const HostPort& at, std::string_view option) {
  std::vector<int> sockets;
  if (at.host == "0.0.0.0" || at.host == "::") {
    if (const int socket = listen_everywhere(at.port); socket >= 0) {
      return std::vector<int>{socket};
    }
  }
  int port = at.port, error = 0;
  LM_ASSIGN_OR_RETURN(const AddressInfo found, resolve(at));
  for (const addrinfo* each = found.get(); each != nullptr; each = each->ai_next) {
    sockaddr_storage address{};
    std::memcpy(&address, each->ai_addr, each->ai_addrlen);
    auto& field = address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(address).sin6_port
                                                : reinterpret_cast<sockaddr_in&>(address).sin_port;
    field = htons(static_cast<std::uint16_t>(port));
    if (const int socket = listen_at(reinterpret_cast<const sockaddr*>(&address), each->ai_addrlen); socket >= 0) {
      sockets.push_back(socket);
      port = port_of(local_address(socket));
    } else if (error == 0) {
      error = -socket;
    }
  }
  return sockets.empty() ? unavailable("{}", bind_problem(error, option)) : Result<std::vector<int>>(sockets);
}

/// All bytes since the connection began, without TCP's headers. 0 if it is no TCP connection.
std::uint64_t received_bytes(int socket) {
  tcp_info info{};
  socklen_t size = sizeof info;
  return ::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 ? info.tcpi_bytes_received : 0;
}

}  // namespace

Result<std::unique_ptr<Listener>> Listener::open(const std::string& listen, std::string_view option, std::size_t most) {
  LM_ASSIGN_OR_RETURN(const HostPort at, parse_host_port(listen));
  LM_ASSIGN_OR_RETURN(std::vector<int> sockets,
                      with_context(listen_on(at, option), fmt::format("cannot listen on {}", listen)));
  const int port = port_of(local_address(sockets.front()));
  const int wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  auto listener = std::unique_ptr<Listener>(new Listener(std::move(sockets), port, wake, most));
  if (wake < 0) {
    return unavailable("cannot listen on {}: {}", listen, std::strerror(errno));
  }
  return listener;
}

Listener::Listener(std::vector<int> sockets, int port, int wake, std::size_t most)
    : sockets_(std::move(sockets)), port_(port), wake_(wake), limiter_(most) {}

Listener::~Listener() {
  stop();
  for (const auto& [id, peer] : waiting_) {
    ::close(open_.at(id).fd);
  }
  for (const int socket : sockets_) {
    ::close(socket);
  }
  if (wake_ >= 0) {
    ::close(wake_);
  }
}

void Listener::start(Take take) {
  take_ = std::move(take);
  thread_ = std::thread([this] { run(); });
}

void Listener::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  (void)::eventfd_write(wake_, 1);
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Listener::run() {
  std::vector<pollfd> all{{wake_, POLLIN, 0}};
  for (const int socket : sockets_) {
    all.push_back({socket, POLLIN, 0});
  }
  bool failed = false;
  for (;;) {
    bool waits = false, counts = false, counts_unread = false;
    {
      const MutexLock lock(mutex_);
      if (stopping_) {
        return;
      }
      waits = limiter_.has_waiting();
      counts = unknown_bytes_ && !limiter_.unknown().empty();
      counts_unread = unread_ && limiter_.size() > 0;
    }
    // If accept failed, the listening sockets would be ready at once, so they are not polled.
    const int pause = failed || waits ? kPauseMs : counts ? kCountMs : counts_unread ? kCountUnreadMs : kIdleMs;
    (void)::poll(all.data(), failed ? 1 : all.size(), pause);
    if (std::uint64_t count = 0; all[0].revents != 0) {
      (void)::eventfd_read(wake_, &count);
    }
    const bool try_all = std::exchange(failed, false);
    for (std::size_t i = 1; i < all.size(); ++i) {
      if (try_all || all[i].revents != 0) {
        failed = !accept_all(all[i].fd) || failed;
      }
      all[i].revents = 0;
    }
    update();
  }
}

bool Listener::accept_all(int listening) {
  for (int i = 0; i < kAcceptedAtOnce; ++i) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    const int fd = ::accept4(listening, reinterpret_cast<sockaddr*>(&address), &size, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0) {
      arrive(fd, text_of(address));
      continue;
    }
    switch (errno) {
      case EAGAIN:
        return true;
      case EINTR:
      case ECONNABORTED:
      case EPROTO:
      case ENETDOWN:
      case ENETUNREACH:
      case EHOSTDOWN:
      case EHOSTUNREACH:  // errors of the connection, which is gone
        continue;
      default: {  // for example too many open files: another attempt would fail at once
        const int error = errno;
        const Time now = system_clock().now();
        const bool tell = told_at_ == Time{} || now - told_at_ >= kTellPause;
        told_at_ = tell ? now : told_at_;
        spdlog::log(tell ? spdlog::level::warn : spdlog::level::debug,
                    "port {} cannot accept a connection: {}. It tries again every {} ms", port_, std::strerror(error),
                    kPauseMs);
        return false;
      }
    }
  }
  return true;
}

void Listener::arrive(int fd, const std::string& peer) {
  {
    const MutexLock lock(mutex_);
    const Time now = system_clock().now();
    if (peer == own_) {
      own_.clear();
    } else {
      if (limiter_.is_full() || limiter_.is_full(peer)) {
        sweep(now);
      }
      const ConnectionLimiter::Arrival arrival = limiter_.arrive(peer, now);
      if (arrival.close != 0) {
        ::close(open_.at(arrival.close).fd);
        open_.erase(arrival.close);
        waiting_.erase(arrival.close);
      }
      if (arrival.end != 0) {
        shut(arrival.end);
      }
      struct stat about {};
      if (arrival.decision == ConnectionLimiter::Decision::refuse || ::fstat(fd, &about) != 0) {
        ::close(fd);
        return;
      }
      open_[arrival.id] = {fd, about.st_dev, about.st_ino};
      if (arrival.decision == ConnectionLimiter::Decision::wait) {
        waiting_[arrival.id] = peer;
        return;
      }
    }
  }
  take_(fd, peer);
}

void Listener::update() {
  end_large_unread(system_clock().now());
  std::vector<std::pair<int, std::string>> served;
  {
    const MutexLock lock(mutex_);
    const Time now = system_clock().now();
    if (limiter_.has_waiting() || now - swept_at_ >= kIdlePause) {
      sweep(now);
    }
    end_large_unknown();
    const ConnectionLimiter::Changes changes = limiter_.update(now);
    for (const Id id : changes.end) {
      shut(id);
    }
    for (const Id id : changes.serve) {
      served.emplace_back(open_.at(id).fd, std::move(waiting_.at(id)));
      waiting_.erase(id);
    }
  }
  for (const auto& [fd, peer] : served) {
    take_(fd, peer);
  }
}

void Listener::end_large_unknown() {
  if (!unknown_bytes_) {
    return;
  }
  std::vector<std::pair<std::uint64_t, Id>> received;
  std::uint64_t all = 0;
  for (const Id id : limiter_.unknown()) {
    received.emplace_back(received_bytes(open_.at(id).fd), id);
    all += received.back().first;
  }
  std::ranges::sort(received, std::greater());
  for (const auto& [bytes, id] : received) {
    if (bytes <= unknown_bytes_->of_connection && all <= unknown_bytes_->of_all) {
      break;
    }
    spdlog::debug("port {}: a connection of an unknown caller is ended after {} bytes", port_, bytes);
    shut(id);
    limiter_.end(id);
    all -= bytes;
  }
}

void Listener::end_large_unread(Time now) {
  if (!unread_ || now < count_unread_at_) {
    return;
  }
  // Sockets are read under the lock. A message that is taken after its socket was read would lose its credit.
  const MutexLock lock(mutex_);
  std::vector<UnreadBytes::Received> received;
  for (ConnectionLimiter::Known& each : limiter_.known()) {
    const Socket& socket = open_.at(each.id);
    received.push_back(
        {each.id, std::move(each.caller), socket.is_open() ? received_bytes(socket.fd) : 0, each.may_be_many});
  }
  count_unread_at_ = now + std::max(kCountUnread, kCountUnreadOfOne * static_cast<int>(received.size()));
  for (const Id id : unread_->over(received, now)) {
    if (const auto found = open_.find(id); found != open_.end()) {
      spdlog::warn(
          "port {}: closed the connection from {}, because it, its caller or all callers together have sent more bytes of "
          "incomplete requests than --wire-gib allows",
          port_, limiter_.peer_of(id));
      shut(id);
      limiter_.end(id);
    }
  }
}

void Listener::taken(const std::string& peer, std::uint64_t bytes, std::uint64_t overhead) {
  const MutexLock lock(mutex_);
  if (const Id id = limiter_.id_of(peer); unread_ && id != 0) {
    unread_->taken(id, bytes, overhead);
  }
}

/// The server closes connections without notice. Then the file descriptor is free, or another file has it.
bool Listener::Socket::is_open() const {
  struct stat about {};
  return ::fstat(fd, &about) == 0 && about.st_dev == device && about.st_ino == inode;
}

void Listener::sweep(Time now) {
  if (now - swept_at_ < kSweepPause) {
    return;
  }
  swept_at_ = now;
  std::erase_if(open_, [this](const auto& entry) LM_REQUIRES(mutex_) {
    const auto& [id, socket] = entry;
    const bool closed = !socket.is_open();
    if (closed) {
      limiter_.leave(id);
    }
    return closed;
  });
}

/// The server sees the end and closes the socket. Between the two calls, the descriptor may become another file's. If
/// that is no socket, nothing happens. If it is a connection, its owner connects again.
void Listener::shut(Id id) {
  if (const auto found = open_.find(id); found != open_.end() && found->second.is_open()) {
    ::shutdown(found->second.fd, SHUT_RDWR);
  }
}

Status Listener::set_caller(const std::string& peer, const Identity& caller) {
  Status status;
  bool waits = false;
  {
    const MutexLock lock(mutex_);
    if (limiter_.is_full(peer, caller)) {
      sweep(system_clock().now());
    }
    status = limiter_.set_caller(peer, caller);
    waits = limiter_.has_waiting();
  }
  if (waits) {
    (void)::eventfd_write(wake_, 1);
  }
  return status;
}

void Listener::clear_caller(const std::string& peer) {
  const MutexLock lock(mutex_);
  limiter_.clear_caller(peer, system_clock().now());
}

Result<int> Listener::connect_to_self() {
  sockaddr_storage address = local_address(sockets_.front());
  if (address.ss_family == AF_INET6) {
    if (auto& v6 = reinterpret_cast<sockaddr_in6&>(address); IN6_IS_ADDR_UNSPECIFIED(&v6.sin6_addr)) {
      ::inet_pton(AF_INET6, "::ffff:127.0.0.1", &v6.sin6_addr);  // ::1 does not exist if IPv6 is off
    }
  } else if (auto& v4 = reinterpret_cast<sockaddr_in&>(address); v4.sin_addr.s_addr == INADDR_ANY) {
    v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }
  const MutexLock lock(mutex_);
  const int fd = ::socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const socklen_t size = address.ss_family == AF_INET6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
  if (fd < 0 || (::connect(fd, reinterpret_cast<const sockaddr*>(&address), size) != 0 && errno != EINPROGRESS)) {
    const int error = errno;
    if (fd >= 0) {
      ::close(fd);
    }
    return unavailable("port {} cannot be reached from inside: {}", port_, std::strerror(error));
  }
  own_ = text_of(local_address(fd));
  return fd;
}

}  // namespace lightmill
