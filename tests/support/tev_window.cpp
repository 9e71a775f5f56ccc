#include "tests/support/tev_window.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <utility>

namespace lightmill::test {
namespace {

using Image = TevWindow::Image;

bool readable(int socket, std::chrono::milliseconds timeout) {
  pollfd ready{socket, POLLIN, 0};
  return ::poll(&ready, 1, static_cast<int>(timeout.count())) == 1;
}

int bound_to(std::uint16_t port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  return socket;
}

std::uint16_t port_of(int socket) {
  sockaddr_in address{};
  socklen_t length = sizeof address;
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length);
  return ntohs(address.sin_port);
}

/// Reads one packet.
class Packet {
 public:
  explicit Packet(std::string bytes) : bytes_(std::move(bytes)) {}

  void apply(std::map<std::string, Image>& images) {
    take<std::uint32_t>();  // length
    const auto type = take<std::int8_t>();
    take<std::int8_t>();  // whether to grab the focus
    const std::string name = text();
    if (type == 4) {
      Image image;
      image.width = take<std::int32_t>();
      image.height = take<std::int32_t>();
      channels();
      image.planes.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
      images[name] = image;
    } else {
      EXPECT_EQ(type, 6);
      update(images.at(name));
    }
    EXPECT_EQ(at_, bytes_.size());
  }

 private:
  template <class T>
  T take() {
    T value{};
    EXPECT_LE(at_ + sizeof value, bytes_.size());
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string text() {
    const std::string read(bytes_.c_str() + at_);
    at_ += read.size() + 1;
    return read;
  }
  void channels() {
    EXPECT_EQ(take<std::int32_t>(), 3);
    for (const char* const name : {"R", "G", "B"}) {
      EXPECT_EQ(text(), name);
    }
  }
  void update(Image& image) {
    channels();
    const auto x = take<std::int32_t>(), y = take<std::int32_t>(), width = take<std::int32_t>(),
               height = take<std::int32_t>();
    ASSERT_TRUE(x >= 0 && y >= 0 && x + width <= image.width && y + height <= image.height);
    std::array<std::int64_t, 3> offsets{}, strides{};
    for (std::int64_t& offset : offsets) {
      offset = take<std::int64_t>();
    }
    for (std::int64_t& stride : strides) {
      stride = take<std::int64_t>();
    }
    std::int64_t most = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      most = std::max(most, offsets[c] + strides[c] * (std::int64_t{width} * height - 1));
    }
    std::vector<float> data(static_cast<std::size_t>(most) + 1);
    ASSERT_LE(at_ + data.size() * sizeof(float), bytes_.size());
    std::memcpy(data.data(), bytes_.data() + at_, data.size() * sizeof(float));
    at_ += data.size() * sizeof(float);
    for (int c = 0; c < 3; ++c) {
      for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
          const auto from = static_cast<std::size_t>(offsets[static_cast<std::size_t>(c)] +
                                                     strides[static_cast<std::size_t>(c)] * (row * width + column));
          const auto to = static_cast<std::size_t>((c * image.height + y + row) * image.width + x + column);
          image.planes[to] = data[from];
        }
      }
    }
    ++image.updates;
  }

  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace

TevWindow::TevWindow(TevWindow&& other) noexcept
    : connection_(std::exchange(other.connection_, -1)),
      bytes_read_(other.bytes_read_),
      bytes_(std::move(other.bytes_)),
      images_(std::move(other.images_)) {}

void TevWindow::close() {
  if (connection_ >= 0) {
    ::close(std::exchange(connection_, -1));
  }
}

bool TevWindow::read(std::size_t most, std::chrono::milliseconds timeout) {
  std::vector<char> piece(most);
  const ssize_t length = readable(connection_, timeout) ? ::read(connection_, piece.data(), piece.size()) : 0;
  if (length <= 0) {
    return false;
  }
  bytes_.append(piece.data(), static_cast<std::size_t>(length));
  bytes_read_ += static_cast<std::size_t>(length);
  std::uint32_t packet = 0;
  while (bytes_.size() >= sizeof packet) {
    std::memcpy(&packet, bytes_.data(), sizeof packet);
    if (bytes_.size() < packet) {
      break;
    }
    Packet(bytes_.substr(0, packet)).apply(images_);
    bytes_.erase(0, packet);
  }
  return true;
}

TevListener::TevListener(std::uint16_t port, int buffer_bytes) : listening_(bound_to(port)) {
  port_ = port_of(listening_);
  if (port == 0) {
    // A socket with a port that the kernel chose loses the port in stop().
    const int chosen = std::exchange(listening_, bound_to(port_));
    ::close(chosen);
  }
  if (buffer_bytes > 0) {
    ::setsockopt(listening_, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
  }
  listen();
}

TevListener::~TevListener() {
  ::close(listening_);
}

void TevListener::stop() const {
  EXPECT_EQ(::shutdown(listening_, SHUT_RD), 0);
}

void TevListener::listen() const {
  EXPECT_EQ(::listen(listening_, 1), 0);
}

std::string TevListener::address() const {
  return fmt::format("127.0.0.1:{}", port_);
}

bool TevListener::called(std::chrono::milliseconds timeout) const {
  return readable(listening_, timeout);
}

TevWindow TevListener::accept() const {
  EXPECT_TRUE(called(kTimeout));
  return TevWindow(::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC));
}

}  // namespace lightmill::test
