// A proxy in front of a TCP port or a local socket. Its connections can be slow, stall, lose bytes, and be cut.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "common/base/mutex.h"

namespace lightmill::test {

/// The direction of bytes: from the connecting side, or back to it.
enum class Way { there, back };

class FaultProxy {
 public:
  /// Listens on 127.0.0.1 and connects each caller to `target`: HOST:PORT with a numeric host, or a local socket's
  /// file.
  explicit FaultProxy(std::string target);
  ~FaultProxy();
  FaultProxy(const FaultProxy&) = delete;
  FaultProxy& operator=(const FaultProxy&) = delete;

  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  // These affect all connections from now on.

  /// Delays each piece by a random time between `least` and `most`. Pieces of one connection stay in order, as in TCP.
  /// They can overtake those of other connections.
  void delay(Way way, std::chrono::milliseconds least, std::chrono::milliseconds most);
  /// Holds bytes back, like a link that is cut in one direction. They arrive when the stall ends.
  void stall(Way way, bool stalls) { direction(way).stalls = stalls; }
  /// Drops bytes.
  void swallow(Way way, bool swallows) { direction(way).swallows = swallows; }
  /// Closes new connections at once.
  void refuse(bool refuses) { refuses_ = refuses; }
  int times_refused() const { return times_refused_; }
  /// Ends all connections.
  void cut();

 private:
  struct Direction {
    std::atomic<int> least_ms = 0, most_ms = 0;
    std::atomic<bool> stalls = false, swallows = false;
  };
  Direction& direction(Way way) { return directions_[way == Way::there ? 0 : 1]; }
  void accept_all();
  int connect_target() const;
  void relay(int from, int to, const Direction& direction, std::uint64_t seed);

  const std::string target_;
  int listener_ = -1, port_ = 0;
  std::array<Direction, 2> directions_;
  std::atomic<bool> refuses_ = false, ends_ = false;
  std::atomic<int> times_refused_ = 0;
  Mutex mutex_;
  std::vector<int> sockets_ LM_GUARDED_BY(mutex_);
  std::vector<std::thread> relays_ LM_GUARDED_BY(mutex_);
  std::thread accepting_;
};

}  // namespace lightmill::test
