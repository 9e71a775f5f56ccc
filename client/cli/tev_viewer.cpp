#include "client/cli/tev_viewer.h"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "client/tev/tev_packets.h"
#include "common/wire/bytes.h"

namespace lightmill::cli {
namespace {

constexpr auto kRetryPause = std::chrono::seconds(2);
/// A viewer that takes nothing for so long is as good as gone.
constexpr int kPatienceSeconds = 5;
constexpr auto kLastWords = std::chrono::seconds(3);

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

/// A connected socket, or -1 and why not.
int connected_socket(const HostPort& address, std::string& why) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found)) {
    why = ::gai_strerror(error);
    return -1;
  }
  const std::unique_ptr<addrinfo, FreeAddresses> list(found);
  for (const addrinfo* at = list.get(); at != nullptr; at = at->ai_next) {
    const int made = ::socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
    const timeval patience{kPatienceSeconds, 0};
    if (made >= 0 && ::setsockopt(made, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) == 0 &&
        ::connect(made, at->ai_addr, at->ai_addrlen) == 0) {
      return made;
    }
    why = std::strerror(errno);
    if (made >= 0) {
      ::close(made);
    }
  }
  return -1;
}

}  // namespace

TevViewer::TevViewer(HostPort address, std::uint64_t job, const Console& console)
    : address_(std::move(address)), console_(console), name_(fmt::format("job {}", job)), thread_([this] { run(); }) {}

TevViewer::~TevViewer() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
  if (socket_ >= 0) {
    ::close(socket_);
  }
}

void TevViewer::update(const v1::WatchJobResponse& response) {
  if (response.tiles().empty()) {
    return;
  }
  const v1::PixelRect& crop = response.job().crop();
  const MutexLock lock(mutex_);
  if (width_ == 0) {
    width_ = crop.width();
    height_ = crop.height();
    if (!response.job().name().empty()) {
      name_ += " " + response.job().name();
    }
  }
  for (const v1::PreviewTile& tile : response.tiles()) {
    const v1::PixelRect& rect = tile.rect();
    Result<std::vector<float>> planes = floats_from_bytes(tile.rgb());
    const int x = rect.x() - crop.x(), y = rect.y() - crop.y();
    const bool inside = rect.width() > 0 && rect.height() > 0 && x >= 0 && y >= 0 && rect.width() <= width_ - x &&
                        rect.height() <= height_ - y;
    if (inside && planes.ok() && planes->size() == std::size_t{3} * rect.width() * rect.height()) {
      tiles_[{y, x}] = {rect.width(), rect.height(), *std::move(planes), false};
    }
  }
  changed_.notify_all();
}

std::string TevViewer::next_packet() {
  const MutexLock lock(mutex_);
  if (width_ == 0) {
    return "";
  }
  if (!created_) {
    created_ = true;
    for (auto& [place, tile] : tiles_) {
      tile.sent = false;
    }
    return tev_create_image(name_, width_, height_, true);
  }
  for (auto& [place, tile] : tiles_) {
    if (!std::exchange(tile.sent, true)) {
      return tev_update_image(name_, place.second, place.first, tile.width, tile.height, tile.planes);
    }
  }
  return "";
}

void TevViewer::run() {
  std::optional<std::chrono::steady_clock::time_point> until;  // of the last words
  for (;;) {
    if (socket_ < 0 && !connect()) {
      const MutexLock lock(mutex_);
      const auto next = std::chrono::steady_clock::now() + kRetryPause;
      while (!stopping_ && changed_.wait_until(mutex_, next) == std::cv_status::no_timeout) {
      }
      if (stopping_) {
        return;
      }
      continue;
    }
    const std::string packet = next_packet();
    if (!packet.empty()) {
      if (!send(packet)) {
        disconnect(std::strerror(errno));
      }
    }
    const MutexLock lock(mutex_);
    if (stopping_ && !until) {
      until = std::chrono::steady_clock::now() + kLastWords;
    }
    if (stopping_ && (packet.empty() || socket_ < 0 || std::chrono::steady_clock::now() > *until)) {
      return;
    }
    while (packet.empty() && !stopping_ &&
           std::ranges::all_of(tiles_, [](const auto& each) { return each.second.sent; })) {
      changed_.wait(mutex_);
    }
  }
}

bool TevViewer::connect() {
  std::string why;
  socket_ = connected_socket(address_, why);
  if (socket_ < 0) {
    disconnect(why);
    return false;
  }
  if (std::exchange(told_, false)) {
    console_.notice(fmt::format("the picture goes to the viewer at {}:{}", address_.host, address_.port));
  }
  return true;
}

bool TevViewer::send(const std::string& packet) {
  for (std::size_t sent = 0; sent < packet.size();) {
    const ssize_t more = ::send(socket_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL);
    if (more < 0 && errno == EINTR) {
      continue;
    }
    if (more <= 0) {
      return false;
    }
    sent += static_cast<std::size_t>(more);
  }
  return true;
}

void TevViewer::disconnect(const std::string& why) {
  if (socket_ >= 0) {
    ::close(std::exchange(socket_, -1));
  }
  {
    const MutexLock lock(mutex_);
    created_ = false;
  }
  if (!std::exchange(told_, true)) {
    console_.notice(fmt::format("no viewer at {}:{} ({}): start tev or HDRView there; it is tried again", address_.host,
                                address_.port, why));
  }
}

}  // namespace lightmill::cli
