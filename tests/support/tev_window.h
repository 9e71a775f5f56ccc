// A stand-in for the viewer tev: a port that listens, and images made of the packets that arrive. Packets are read as
// tev documents them.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace lightmill::test {

/// One connection, and the images that it brought.
class TevWindow {
 public:
  struct Image {
    int width = 0, height = 0;
    std::vector<float> planes;
    int updates = 0;
    /// Red value of a pixel.
    float at(int x, int y) const { return planes.at(static_cast<std::size_t>(y * width + x)); }
  };

  explicit TevWindow(int connection) : connection_(connection) {}
  ~TevWindow() { close(); }
  TevWindow(TevWindow&& other) noexcept;
  TevWindow& operator=(TevWindow&&) = delete;

  /// Reads up to `most` bytes that arrive within `timeout`. False if nothing arrives, or the other side has closed.
  bool read(std::size_t most = 65536, std::chrono::milliseconds timeout = kTimeout);
  std::size_t bytes_read() const { return bytes_read_; }
  void close();
  /// Images by name, after all complete packets.
  const std::map<std::string, Image>& images() const { return images_; }
  /// Whether part of a packet has arrived.
  bool amid_a_packet() const { return !bytes_.empty(); }

 private:
  int connection_;
  std::size_t bytes_read_ = 0;
  std::string bytes_;  ///< of an incomplete packet
  std::map<std::string, Image> images_;
};

/// Listens on 127.0.0.1 like tev.
class TevListener {
 public:
  /// Port 0 takes a free port. `buffer_bytes` limits the unread bytes of a connection. 0 leaves the kernel's limit of
  /// megabytes.
  explicit TevListener(std::uint16_t port = 0, int buffer_bytes = 0);
  ~TevListener();
  TevListener(const TevListener&) = delete;
  TevListener& operator=(const TevListener&) = delete;

  std::uint16_t port() const { return port_; }
  std::string address() const;
  /// Refuses new and waiting connections. The port stays taken.
  void stop() const;
  /// Listens again after a stop.
  void listen() const;
  /// Whether a connection waits to be accepted.
  bool called(std::chrono::milliseconds timeout) const;
  /// Accepts the next connection.
  TevWindow accept() const;

 private:
  int listening_;
  std::uint16_t port_ = 0;
};

}  // namespace lightmill::test
