// Whether the coordinator's own port answers: dialled from inside again and again.
#pragma once

#include <functional>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/listen/listener.h"

namespace lightmill {

/// What follows from dials that were answered or not.
class Hearing {
 public:
  enum class Verdict { hears, doubtful, deaf };

  explicit Hearing(Time now) : last_answer_(now) {}
  Verdict note(bool answered, Time now);

  /// After so many dials without an answer, one after the other, it is doubtful.
  static constexpr int kDoubtful = 3;
  /// Deaf is what has answered once, and then not for so long and so many dials. A machine may stand still for a while.
  static constexpr int kDeaf = 10;
  static constexpr Duration kPatience = std::chrono::minutes(2);

 private:
  bool answered_once_ = false;
  int failures_ = 0;
  Time last_answer_;
};

/// Owns a thread, which dials.
class SelfCheck {
 public:
  /// Between two dials.
  static constexpr Duration kPause = std::chrono::seconds(5);

  /// `on_hearing` is told whenever it becomes doubtful that the port answers, and when it does again; `on_deaf` once,
  /// when there is no hope. Both from the thread.
  SelfCheck(Listener& listener, bool encrypted, const Clock& clock, std::function<void(bool)> on_hearing,
            std::function<void(const Status&)> on_deaf, Duration pause = kPause);
  ~SelfCheck();
  SelfCheck(const SelfCheck&) = delete;
  SelfCheck& operator=(const SelfCheck&) = delete;

 private:
  void run();
  Status dial();
  /// Whether it goes on.
  bool pause();

  Listener& listener_;
  const bool encrypted_;
  const Clock& clock_;
  const Duration pause_;
  const std::function<void(bool)> on_hearing_;
  const std::function<void(const Status&)> on_deaf_;
  Mutex mutex_;
  CondVar changed_;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  int socket_ LM_GUARDED_BY(mutex_) = -1;  ///< of the dial under way
  std::thread thread_;
};

}  // namespace lightmill
