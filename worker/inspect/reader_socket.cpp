#include "worker/inspect/reader_socket.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace lightmill {
namespace {

constexpr int kTimeoutMs = 20;  ///< between two calls of may_continue
constexpr std::size_t kPartBytes = std::size_t{1} << 20;

}  // namespace

struct ReaderSocket::Head {
  ReaderMessage message{};
  std::int32_t code = 0;  ///< a StatusCode; unless it is OK, the bytes are the error's text
  std::uint64_t bytes = 0;
};

Status ReaderSocket::other_end_closed() {
  closed_ = true;
  return unavailable("the scene reader or its worker has ended");
}

Status ReaderSocket::wait(short events) const {
  for (;;) {
    if (may_continue_) {
      LM_RETURN_IF_ERROR(may_continue_());
    }
    pollfd ready{socket_.number(), events, 0};
    const int polled = ::poll(&ready, 1, may_continue_ ? kTimeoutMs : -1);
    if (polled > 0) {
      return ok_status();
    }
    if (polled < 0 && errno != EINTR) {
      return internal_error("a scene reader's socket cannot be watched: {}", std::strerror(errno));
    }
  }
}

Status ReaderSocket::send_bytes(std::string_view bytes) {
  while (!bytes.empty()) {
    LM_RETURN_IF_ERROR(wait(POLLOUT));
    const ssize_t sent =
        ::send(socket_.number(), bytes.data(), std::min(bytes.size(), kPartBytes), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EINTR && errno != EAGAIN) {
      return other_end_closed();
    }
    bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(sent, 0)));
  }
  return ok_status();
}

Status ReaderSocket::receive_bytes(char* to, std::size_t size) {
  while (size > 0) {
    LM_RETURN_IF_ERROR(wait(POLLIN));
    const ssize_t got = ::recv(socket_.number(), to, size, MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) {
      return other_end_closed();
    }
    to += std::max<ssize_t>(got, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
  return ok_status();
}

Status ReaderSocket::send(const Head& head, std::initializer_list<std::string_view> parts) {
  LM_RETURN_IF_ERROR(send_bytes({reinterpret_cast<const char*>(&head), sizeof(head)}));
  for (const std::string_view part : parts) {
    LM_RETURN_IF_ERROR(send_bytes(part));
  }
  return ok_status();
}

Status ReaderSocket::send(ReaderMessage message, std::initializer_list<std::string_view> parts) {
  Head head{message, 0, 0};
  for (const std::string_view part : parts) {
    head.bytes += part.size();
  }
  return send(head, parts);
}

Status ReaderSocket::send_error(ReaderMessage message, const Status& error) {
  const std::string text = message_of(error);
  return send(Head{message, static_cast<std::int32_t>(error.code()), text.size()}, {text});
}

Result<ReaderSocket::Received> ReaderSocket::receive() {
  Head head;
  LM_RETURN_IF_ERROR(receive_bytes(reinterpret_cast<char*>(&head), sizeof(head)));
  if (head.bytes > most_bytes_) {
    return internal_error("a message of {} bytes exceeds the limit of {}", head.bytes, most_bytes_);
  }
  std::string bytes;
  bytes.reserve(head.bytes);
  while (bytes.size() < head.bytes) {  // in parts, so that only bytes that came take memory
    const std::size_t done = bytes.size();
    bytes.resize(done + std::min<std::uint64_t>(head.bytes - done, kPartBytes));
    LM_RETURN_IF_ERROR(receive_bytes(bytes.data() + done, bytes.size() - done));
  }
  if (head.code != 0) {
    return Received{head.message, make_error(static_cast<StatusCode>(head.code), "{}", bytes)};
  }
  return Received{head.message, std::move(bytes)};
}

}  // namespace lightmill
