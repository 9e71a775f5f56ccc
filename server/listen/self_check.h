// Self-check of the coordinator's port: calls its health service regularly, over a new connection from inside.
#pragma once

#include <functional>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/listen/listener.h"

namespace lightmill {

/// State of a port, from the results of probes.
class PortHealth {
 public:
  enum class Verdict { answering, doubtful, unresponsive };

  explicit PortHealth(Time now) : last_answer_(now) {}
  Verdict note(bool answered, Time now);

  /// Failed probes in a row until the port is doubtful.
  static constexpr int kDoubtful = 3;
  /// Failed probes in a row until the port is unresponsive, if it has answered before and is silent for kTimeout. A
  /// machine may stop for a while.
  static constexpr int kUnresponsive = 10;
  static constexpr Duration kTimeout = std::chrono::minutes(2);

 private:
  bool answered_once_ = false;
  int failures_ = 0;
  Time last_answer_;
};

/// Owns a thread that probes the port.
class SelfCheck {
 public:
  /// Time between two probes.
  static constexpr Duration kPause = std::chrono::seconds(5);

  /// `on_answering` is called when the port becomes doubtful, and when it answers again. `on_unresponsive` is called
  /// once, when the port is unresponsive. Both run on the thread.
  SelfCheck(Listener& listener, bool encrypted, const Clock& clock, std::function<void(bool)> on_answering,
            std::function<void(const Status&)> on_unresponsive, Duration pause = kPause);
  ~SelfCheck();
  SelfCheck(const SelfCheck&) = delete;
  SelfCheck& operator=(const SelfCheck&) = delete;

 private:
  void run();
  Status probe();
  /// False if it stops.
  bool pause();

  Listener& listener_;
  const bool encrypted_;
  const Clock& clock_;
  const Duration pause_;
  const std::function<void(bool)> on_answering_;
  const std::function<void(const Status&)> on_unresponsive_;
  Mutex mutex_;
  CondVar changed_;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  int socket_ LM_GUARDED_BY(mutex_) = -1;  ///< of the probe in progress
  std::thread thread_;
};

}  // namespace lightmill
