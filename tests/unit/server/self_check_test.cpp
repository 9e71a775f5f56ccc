// Detection of a coordinator's own port that does not answer.
#include "server/listen/self_check.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>

namespace lightmill {
namespace {

using Verdict = PortHealth::Verdict;

Time health_time(double seconds) {
  return Time{from_seconds(1'000 + seconds)};
}

TEST(PortHealth, AnAnswerResetsTheCountOfUnansweredDials) {
  PortHealth health(health_time(0));
  EXPECT_EQ(health.note(true, health_time(0)), Verdict::answering);
  for (int i = 1; i < PortHealth::kDoubtful; ++i) {
    EXPECT_EQ(health.note(false, health_time(i)), Verdict::answering);
  }
  EXPECT_EQ(health.note(false, health_time(10)), Verdict::doubtful);
  EXPECT_EQ(health.note(true, health_time(11)), Verdict::answering);
  EXPECT_EQ(health.note(false, health_time(12)), Verdict::answering);
}

TEST(PortHealth, APortIsUnresponsiveAfterManyUnansweredDialsOverALongTime) {
  PortHealth health(health_time(0));
  EXPECT_EQ(health.note(true, health_time(0)), Verdict::answering);
  EXPECT_NE(health.note(false, health_time(10'000)), Verdict::unresponsive) << "the machine stood still";
  for (int i = 2; i < PortHealth::kUnresponsive; ++i) {
    EXPECT_NE(health.note(false, health_time(10'000 + i)), Verdict::unresponsive);
  }
  EXPECT_EQ(health.note(false, health_time(10'100)), Verdict::unresponsive);

  PortHealth hasty(health_time(0));
  (void)hasty.note(true, health_time(0));
  for (int i = 0; i < 10 * PortHealth::kUnresponsive; ++i) {
    EXPECT_NE(hasty.note(false, health_time(1)), Verdict::unresponsive);
  }
}

TEST(PortHealth, APortThatHasNeverAnsweredIsNotUnresponsive) {
  PortHealth health(health_time(0));
  for (int i = 0; i < 10 * PortHealth::kUnresponsive; ++i) {
    EXPECT_NE(health.note(false, health_time(1'000.0 * i)), Verdict::unresponsive);
  }
}

/// A clock that moves half a minute with each reading.
class LeapingClock final : public Clock {
 public:
  Time now() const override { return health_time(30.0 * ++looks_); }
  std::int64_t unix_milliseconds() const override { return 0; }

 private:
  mutable std::atomic<int> looks_ = 0;
};

/// Reports of a SelfCheck, in order.
class Said {
 public:
  void add(const std::string& what) {
    const MutexLock lock(mutex_);
    all_.push_back(what);
    changed_.notify_all();
  }
  /// Waits for `count` reports.
  std::vector<std::string> first(std::size_t count) {
    const MutexLock lock(mutex_);
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (all_.size() < count && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
    }
    return all_;
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  std::vector<std::string> all_ LM_GUARDED_BY(mutex_);
};

/// A port whose server answers calls on the probes that `answers` accepts by number. On the others it sends only HTTP/2's
/// settings. A send may fail, because a check that ends closes its connection in the middle of a probe.
class MoodyPort {
 public:
  explicit MoodyPort(std::function<bool(int)> answers)
      : listener_(Listener::open("127.0.0.1:0", "--listen", 8).value()) {
    listener_->start([answers = std::move(answers), probe = 0](int socket, const std::string&) mutable {
      constexpr std::string_view kSettings("\0\0\0\4\0\0\0\0\0", 9), kHeaders("\0\0\0\1\4\0\0\0\1", 9);
      (void)::send(socket, kSettings.data(), kSettings.size(), MSG_NOSIGNAL);
      if (answers(probe++)) {
        (void)::send(socket, kHeaders.data(), kHeaders.size(), MSG_NOSIGNAL);
        pollfd gone{socket, POLLRDHUP, 0};  // before it has read the answer, it might miss it
        EXPECT_EQ(::poll(&gone, 1, 60'000), 1);
      }
      ::close(socket);
    });
  }
  ~MoodyPort() { listener_->stop(); }
  Listener& listener() { return *listener_; }

 private:
  const std::unique_ptr<Listener> listener_;
};

TEST(SelfCheck, ReportsWhenAPortStopsAnsweringAndResumes) {
  MoodyPort port([](int probe) { return probe < 1 || probe >= 1 + PortHealth::kDoubtful; });
  Said said;
  const SelfCheck check(
      port.listener(), false, system_clock(), [&](bool answering) { said.add(answering ? "hears" : "doubts"); },
      [&](const Status&) { said.add("unresponsive"); }, Duration::zero());
  EXPECT_EQ(said.first(2), (std::vector<std::string>{"doubts", "hears"}));
}

TEST(SelfCheck, APortThatStaysUnresponsiveEndsTheProgram) {
  MoodyPort port([](int probe) { return probe < 1; });
  Said said;
  const LeapingClock clock;
  const SelfCheck check(
      port.listener(), false, clock, [&](bool answering) { said.add(answering ? "hears" : "doubts"); },
      [&](const Status& why) {
        EXPECT_EQ(why.code(), StatusCode::kUnavailable);
        said.add("unresponsive");
      },
      Duration::zero());
  EXPECT_EQ(said.first(2), (std::vector<std::string>{"doubts", "unresponsive"}));
}

}  // namespace
}  // namespace lightmill
