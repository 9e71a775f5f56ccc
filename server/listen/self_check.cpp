#include "server/listen/self_check.h"

#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "common/base/log.h"
#include "common/security/connection_problem.h"

namespace lightmill {

PortHealth::Verdict PortHealth::note(bool answered, Time now) {
  if (answered) {
    answered_once_ = true;
    failures_ = 0;
    last_answer_ = now;
    return Verdict::answering;
  }
  ++failures_;
  if (answered_once_ && failures_ >= kUnresponsive && now - last_answer_ >= kTimeout) {
    return Verdict::unresponsive;
  }
  return failures_ >= kDoubtful ? Verdict::doubtful : Verdict::answering;
}

SelfCheck::SelfCheck(Listener& listener, bool encrypted, const Clock& clock, std::function<void(bool)> on_answering,
                     std::function<void(const Status&)> on_unresponsive, Duration pause)
    : listener_(listener),
      encrypted_(encrypted),
      clock_(clock),
      pause_(pause),
      on_answering_(std::move(on_answering)),
      on_unresponsive_(std::move(on_unresponsive)),
      thread_([this] { run(); }) {}

SelfCheck::~SelfCheck() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    if (socket_ >= 0) {
      ::shutdown(socket_, SHUT_RDWR);
    }
    changed_.notify_all();
  }
  thread_.join();
}

void SelfCheck::run() {
  PortHealth health(clock_.now());
  bool answering = true;
  do {
    const Status status = probe();
    const PortHealth::Verdict verdict = health.note(status.ok(), clock_.now());
    if (verdict == PortHealth::Verdict::unresponsive) {
      on_unresponsive_(unavailable("port {} does not answer calls from this process any more: {}", listener_.port(),
                                   message_of(status)));
      return;
    }
    if (const bool answers_now = verdict == PortHealth::Verdict::answering; answers_now != answering) {
      answering = answers_now;
      if (answering) {
        spdlog::info("port {} answers again", listener_.port());
      } else {
        spdlog::warn("port {} does not answer calls from this process: {}. Health checks report this", listener_.port(),
                     message_of(status));
      }
      on_answering_(answering);
    }
  } while (pause());
}

Status SelfCheck::probe() {
  LM_ASSIGN_OR_RETURN(const int socket, listener_.connect_to_self());
  {
    const MutexLock lock(mutex_);
    socket_ = socket;
    if (stopping_) {
      ::shutdown(socket, SHUT_RDWR);
    }
  }
  const Status status = check_answers(socket, encrypted_);
  const MutexLock lock(mutex_);
  ::close(std::exchange(socket_, -1));
  return status;
}

bool SelfCheck::pause() {
  const MutexLock lock(mutex_);
  const auto until = std::chrono::steady_clock::now() + pause_;
  while (!stopping_ && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
  }
  return !stopping_;
}

}  // namespace lightmill
