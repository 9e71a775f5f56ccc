// A TCP port before another one (or a local socket) whose lines can be slow, stall, lose what is said, and be cut.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "common/base/mutex.h"

namespace lightmill::test {

/// Which way bytes go: from those who connect, or back to them.
enum class Way { there, back };

class FaultProxy {
 public:
  /// Listens on 127.0.0.1 and connects each that comes to `target`: HOST:PORT, in digits, or a local socket's file.
  explicit FaultProxy(std::string target);
  ~FaultProxy();
  FaultProxy(const FaultProxy&) = delete;
  FaultProxy& operator=(const FaultProxy&) = delete;

  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  // From now on, of all connections:

  /// Each piece arrives so much later, drawn between the two; those of a connection stay in order, as TCP keeps them,
  /// and overtake those of others.
  void delay(Way way, std::chrono::milliseconds least, std::chrono::milliseconds most);
  /// What is said waits, as behind a link that is cut in one direction, and arrives once this ends.
  void stall(Way way, bool stalls) { line(way).stalls = stalls; }
  /// What is said is lost.
  void swallow(Way way, bool swallows) { line(way).swallows = swallows; }
  /// Who connects is hung up on.
  void refuse(bool refuses) { refuses_ = refuses; }
  int times_refused() const { return times_refused_; }
  /// Ends all connections.
  void cut();

 private:
  struct Line {
    std::atomic<int> least_ms = 0, most_ms = 0;
    std::atomic<bool> stalls = false, swallows = false;
  };
  Line& line(Way way) { return lines_[way == Way::there ? 0 : 1]; }
  void accept_all();
  int connect_target() const;
  void relay(int from, int to, const Line& line, std::uint64_t seed);

  const std::string target_;
  int listener_ = -1, port_ = 0;
  std::array<Line, 2> lines_;
  std::atomic<bool> refuses_ = false, ends_ = false;
  std::atomic<int> times_refused_ = 0;
  Mutex mutex_;
  std::vector<int> sockets_ LM_GUARDED_BY(mutex_);
  std::vector<std::thread> relays_ LM_GUARDED_BY(mutex_);
  std::thread accepting_;
};

}  // namespace lightmill::test
