#include "client/cli/outgoing_connection.h"

#include <netdb.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include "client/cli/units.h"
#include "common/base/check.h"

namespace lightmill::cli {
namespace {

/// The kernel reports room once a third of this is free, so a slow reader is seen to read. A larger buffer would hold
/// outdated tiles.
constexpr int kSendBufferBytes = 128 << 10;

Status errno_status(int error) {
  return unavailable("{}", std::strerror(error));
}

/// Whether another try can succeed.
bool not_yet(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

}  // namespace

WakeUp::WakeUp() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  LM_CHECK(fd_ >= 0);
}

WakeUp::~WakeUp() {
  ::close(fd_);
}

void WakeUp::wake() const {
  (void)!::eventfd_write(fd_, 1);  // fails only if it is awake already
}

void WakeUp::clear() const {
  eventfd_t times = 0;
  (void)!::eventfd_read(fd_, &times);
}

void OutgoingConnection::FreeAddresses::operator()(addrinfo* list) const {
  ::freeaddrinfo(list);
}

short OutgoingConnection::poll(short events, Time until) {
  constexpr std::int64_t kLongest = 3'600'000;  // callers check the time themselves
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - clock_.now()).count();
  std::array<pollfd, 2> both{{{wake_up_->fd(), POLLIN, 0}, {socket_, events, 0}}};  // poll ignores a socket of -1
  if (::poll(both.data(), both.size(), static_cast<int>(std::clamp<std::int64_t>(left, 0, kLongest))) <= 0) {
    return 0;
  }
  if (both[0].revents != 0) {
    wake_up_->clear();
  }
  return both[1].revents;
}

Result<OutgoingConnection::Addresses> OutgoingConnection::look_up(const HostPort& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found)) {
    return unavailable("{}", ::gai_strerror(error));
  }
  return Addresses(found);
}

Result<OutgoingConnection::Addresses> OutgoingConnection::addresses(const std::function<bool()>& stopped) {
  if (!looked_up_.valid()) {
    // getaddrinfo cannot be cancelled, so its thread is detached. A lookup still in progress serves the next try.
    std::packaged_task<Result<Addresses>()> task([address = address_] { return look_up(address); });
    looked_up_ = task.get_future();
    std::thread([task = std::move(task), wake_up = wake_up_]() mutable {
      task();
      wake_up->wake();
    }).detach();
  }
  const Time until = clock_.now() + timeout_;
  while (looked_up_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    if (stopped()) {
      return cancelled("stopped");
    }
    if (clock_.now() >= until) {
      return unavailable("the name lookup took longer than {}", human_seconds(to_seconds(timeout_)));
    }
    poll(0, until);
  }
  return looked_up_.get();
}

Status OutgoingConnection::open(const std::function<bool()>& stopped) {
  LM_ASSIGN_OR_RETURN(const Addresses list, addresses(stopped));
  Status status = unavailable("the host has no address");
  for (const addrinfo* at = list.get(); at != nullptr; at = at->ai_next) {
    status = open(*at, stopped);
    if (status.code() != StatusCode::kUnavailable) {
      return status;
    }
    close();
  }
  return status;
}

Status OutgoingConnection::open(const addrinfo& address, const std::function<bool()>& stopped) {
  socket_ = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, address.ai_protocol);
  if (socket_ < 0) {
    return errno_status(errno);
  }
  (void)::setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  if (::connect(socket_, address.ai_addr, address.ai_addrlen) == 0) {
    return ok_status();
  }
  if (errno != EINPROGRESS) {
    return errno_status(errno);
  }
  const Time until = clock_.now() + timeout_;
  while (poll(POLLOUT, until) == 0) {
    if (stopped()) {
      return cancelled("stopped");
    }
    if (clock_.now() >= until) {
      return unavailable("no answer for {}", human_seconds(to_seconds(timeout_)));
    }
  }
  int error = 0;
  socklen_t size = sizeof error;
  if (::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size) != 0) {
    error = errno;
  }
  return error == 0 ? ok_status() : errno_status(error);
}

void OutgoingConnection::close() {
  if (socket_ >= 0) {
    ::close(std::exchange(socket_, -1));
  }
  give("");
}

void OutgoingConnection::give(std::string bytes) {
  bytes_ = std::move(bytes);
  taken_ = 0;
  last_taken_ = clock_.now();
}

Status OutgoingConnection::wait(Time until) {
  const bool sending = !all_taken();
  const Time silent = sending ? last_taken_ + timeout_ : Time::max();
  const short happened = poll(sending ? POLLIN | POLLOUT : POLLIN, std::min(until, silent));
  if ((happened & ~POLLOUT) != 0) {
    LM_RETURN_IF_ERROR(receive());
  }
  if ((happened & POLLOUT) != 0) {
    return send();
  }
  if (clock_.now() < silent) {
    return ok_status();
  }
  // Drops unsent bytes. Otherwise the other side could read them later, between those of the next connection.
  const linger forget{1, 0};
  (void)::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &forget, sizeof forget);
  return unavailable("it has accepted no data for {}", human_seconds(to_seconds(timeout_)));
}

Status OutgoingConnection::send() {
  const ssize_t taken = ::send(socket_, bytes_.data() + taken_, bytes_.size() - taken_, MSG_NOSIGNAL);
  if (taken < 0) {
    return not_yet(errno) ? ok_status() : errno_status(errno);
  }
  taken_ += static_cast<std::size_t>(taken);
  last_taken_ = clock_.now();
  return ok_status();
}

Status OutgoingConnection::receive() {
  std::array<char, 4096> dropped;
  const ssize_t length = ::recv(socket_, dropped.data(), dropped.size(), 0);
  if (length == 0) {
    return unavailable("it has closed the connection");
  }
  return length > 0 || not_yet(errno) ? ok_status() : errno_status(errno);
}

}  // namespace lightmill::cli
