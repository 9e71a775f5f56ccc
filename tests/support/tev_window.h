// What is at the other end of a connection to tev: a port that listens, and images made of packets, which are read as
// tev's documentation has them.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace lightmill::test {

/// One connection, and the images that it has brought.
class TevWindow {
 public:
  struct Image {
    int width = 0, height = 0;
    std::vector<float> planes;
    int updates = 0;
    /// Of red.
    float at(int x, int y) const { return planes.at(static_cast<std::size_t>(y * width + x)); }
  };

  explicit TevWindow(int connection) : connection_(connection) {}
  ~TevWindow() { close(); }
  TevWindow(TevWindow&& other) noexcept;
  TevWindow& operator=(TevWindow&&) = delete;

  /// Takes up to `most` bytes of what arrives within `patience`; false if there is nothing, or the other side has
  /// closed.
  bool read(std::size_t most = 65536, std::chrono::milliseconds patience = kPatience);
  void close();
  /// By name, as they are after all whole packets.
  const std::map<std::string, Image>& images() const { return images_; }
  /// Whether a part of a packet has arrived.
  bool amid_a_packet() const { return !bytes_.empty(); }

 private:
  int connection_;
  std::string bytes_;  ///< of a packet that is not whole yet
  std::map<std::string, Image> images_;
};

/// Listens on 127.0.0.1 as tev does.
class TevListener {
 public:
  /// Port 0 takes a free one. `buffer_bytes`: what connections may hold unread; 0 leaves it to the kernel, which holds
  /// megabytes.
  explicit TevListener(std::uint16_t port = 0, int buffer_bytes = 0);
  ~TevListener();
  TevListener(const TevListener&) = delete;
  TevListener& operator=(const TevListener&) = delete;

  std::uint16_t port() const { return port_; }
  std::string address() const;
  /// Refuses new and waiting connections. The port stays taken.
  void stop() const;
  /// After a stop.
  void listen() const;
  /// Whether somebody waits to be accepted.
  bool called(std::chrono::milliseconds patience) const;
  /// The next who comes.
  TevWindow accept() const;

 private:
  int listening_;
  std::uint16_t port_ = 0;
};

}  // namespace lightmill::test
