#include "server/runtime/demand_hub.h"

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

/// A listener that records each state.
class DemandRecorder final : public DemandSink {
 public:
  bool closed() override { return is_closed; }
  bool writable() const override { return !is_busy; }
  void offer(bool active) override { sent.push_back(active); }

  std::vector<bool> sent;
  bool is_closed = false, is_busy = false;
};

class DemandHubTest : public CoordinatorTest {
 protected:
  std::shared_ptr<DemandRecorder> listen() {
    auto listener = std::make_shared<DemandRecorder>();
    hub.add(listener);
    return listener;
  }
  std::optional<Time> publish() { return hub.publish(*coordinator, now); }

  DemandHub hub;
};

TEST_F(DemandHubTest, TheStateIsSentAtOnceAndThenOnlyItsChanges) {
  const auto listener = listen();
  EXPECT_EQ(publish(), std::nullopt) << "an idle farm is not woken";
  EXPECT_EQ(listener->sent, std::vector{false});
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(listener->sent, std::vector{false});
  const JobId job = submit(spec());
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(listener->sent, (std::vector{false, true}));
  pass(std::chrono::seconds(1));
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  publish();
  EXPECT_EQ(listener->sent, (std::vector{false, true, false}));
  const auto second = listen();
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(second->sent, std::vector{false});
  EXPECT_EQ(listener->sent.size(), 3u);
}

TEST_F(DemandHubTest, DemandIsReadTwiceASecondAtMostAndNoChangeIsLost) {
  const auto listener = listen();
  publish();
  pass(std::chrono::milliseconds(100));
  submit(spec());
  const std::optional<Time> due = publish();
  EXPECT_EQ(listener->sent, std::vector{false}) << "too early";
  ASSERT_TRUE(due.has_value());
  EXPECT_EQ(*due - now, std::chrono::milliseconds(400));
  pass(*due - now);
  EXPECT_EQ(publish(), std::nullopt);
  EXPECT_EQ(listener->sent, (std::vector{false, true}));
}

TEST_F(DemandHubTest, SlowReadersGetTheNewestState) {
  const auto listener = listen();
  publish();
  listener->is_busy = true;
  const JobId job = submit(spec());
  pass(std::chrono::seconds(1));
  publish();
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  submit(spec("r2"));
  listener->is_busy = false;
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(listener->sent, (std::vector{false, true}));
}

TEST_F(DemandHubTest, ClosedStreamsAreForgotten) {
  const auto listener = listen();
  publish();
  listener->is_closed = true;
  submit(spec());
  pass(std::chrono::milliseconds(100));
  EXPECT_EQ(publish(), std::nullopt);
  EXPECT_EQ(listener.use_count(), 1);
}

}  // namespace
}  // namespace lightmill::test
