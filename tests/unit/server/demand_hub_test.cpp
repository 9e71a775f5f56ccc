#include "server/runtime/demand_hub.h"

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

/// A listener that records what it is sent.
class Ear final : public DemandSink {
 public:
  bool closed() const override { return gone; }
  bool writable() const override { return !busy; }
  void offer(bool active) override { told.push_back(active); }

  std::vector<bool> told;
  bool gone = false, busy = false;
};

class DemandHubTest : public CoordinatorTest {
 protected:
  std::shared_ptr<Ear> listen() {
    auto ear = std::make_shared<Ear>();
    hub.add(ear);
    return ear;
  }
  std::optional<Time> publish() { return hub.publish(*coordinator, now); }

  DemandHub hub;
};

TEST_F(DemandHubTest, TheStateIsSentAtOnceAndThenOnlyItsChanges) {
  const auto ear = listen();
  EXPECT_EQ(publish(), std::nullopt) << "an idle farm is not woken";
  EXPECT_EQ(ear->told, std::vector{false});
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(ear->told, std::vector{false});
  const JobId job = submit(spec());
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(ear->told, (std::vector{false, true}));
  pass(std::chrono::seconds(1));
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  publish();
  EXPECT_EQ(ear->told, (std::vector{false, true, false}));
  const auto second = listen();
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(second->told, std::vector{false});
  EXPECT_EQ(ear->told.size(), 3u);
}

TEST_F(DemandHubTest, DemandIsReadTwiceASecondAtMostAndNoChangeIsLost) {
  const auto ear = listen();
  publish();
  pass(std::chrono::milliseconds(100));
  submit(spec());
  const std::optional<Time> due = publish();
  EXPECT_EQ(ear->told, std::vector{false}) << "too early";
  ASSERT_TRUE(due.has_value());
  EXPECT_EQ(*due - now, std::chrono::milliseconds(400));
  pass(*due - now);
  EXPECT_EQ(publish(), std::nullopt);
  EXPECT_EQ(ear->told, (std::vector{false, true}));
}

TEST_F(DemandHubTest, SlowReadersGetTheNewestState) {
  const auto ear = listen();
  publish();
  ear->busy = true;
  const JobId job = submit(spec());
  pass(std::chrono::seconds(1));
  publish();
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  submit(spec("r2"));
  ear->busy = false;
  pass(std::chrono::seconds(1));
  publish();
  EXPECT_EQ(ear->told, (std::vector{false, true}));
}

TEST_F(DemandHubTest, ClosedStreamsAreForgotten) {
  const auto ear = listen();
  publish();
  ear->gone = true;
  submit(spec());
  pass(std::chrono::milliseconds(100));
  EXPECT_EQ(publish(), std::nullopt);
  EXPECT_EQ(ear.use_count(), 1);
}

}  // namespace
}  // namespace lightmill::test
