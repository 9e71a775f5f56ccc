// A TCP port before a local socket, which can swallow what the server answers and cut its connections.
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "common/base/mutex.h"

namespace lightmill::test {

class CutProxy {
 public:
  /// Listens on 127.0.0.1, and connects each that comes to the socket file.
  explicit CutProxy(std::string socket_file);
  ~CutProxy();
  CutProxy(const CutProxy&) = delete;
  CutProxy& operator=(const CutProxy&) = delete;

  int port() const { return port_; }
  /// From now on the server's answers are lost, but not what it is told.
  void swallow_answers(bool swallow) { swallowing_ = swallow; }
  /// Ends all connections.
  void cut();

 private:
  void accept_all();
  void relay(int from, int to, bool answers);

  const std::string socket_file_;
  int listener_ = -1, port_ = 0;
  std::atomic<bool> swallowing_ = false;
  Mutex mutex_;
  std::vector<int> sockets_ LM_GUARDED_BY(mutex_);
  std::vector<std::thread> relays_ LM_GUARDED_BY(mutex_);
  std::thread accepting_;
};

}  // namespace lightmill::test
