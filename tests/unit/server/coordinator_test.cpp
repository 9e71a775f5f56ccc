#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using testing::CoordinatorTest;

TEST_F(CoordinatorTest, AJobIsQueuedThenRunsThenIsDone) {
  const JobId job = submit(spec());
  EXPECT_EQ(status(job).state, JobState::queued);
  const SessionId session = connect("w");
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).fingerprint_class, "class-a");
  work(session);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reason, "reached 4 samples per pixel");
  EXPECT_EQ(status(job).samples_done, 128u * 64 * 4);
  EXPECT_EQ(status(job).counters.results_duplicate, 0u);
  EXPECT_EQ(coordinator->film(job)->min_samples(), 4u);
}

TEST_F(CoordinatorTest, TheClassIsStoredBeforeTheFirstLeaseLeaves) {
  connect("w");
  ASSERT_TRUE(coordinator->submit(spec(), now, unix_ms(), step).ok());
  for (const Outgoing& each : step.now) {
    EXPECT_FALSE(std::holds_alternative<LeaseGrant>(each.message));
    EXPECT_FALSE(std::holds_alternative<JobDescription>(each.message));
  }
  EXPECT_TRUE(std::ranges::any_of(
      step.after_commit, [](const Outgoing& each) { return std::holds_alternative<LeaseGrant>(each.message); }));
  const auto* row = std::get_if<PutJob>(&step.writes.back());
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->record.fingerprint_class, "class-a");
  EXPECT_EQ(row->record.state, JobState::running);
}

TEST_F(CoordinatorTest, AcknowledgesOnlyAfterTheCommitOfTheNode) {
  submit(spec());
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  coordinator->worker_message(session, result(grant, grant.unit.tiles[0]), now, unix_ms(), step);
  EXPECT_TRUE(std::ranges::none_of(
      step.now, [](const Outgoing& each) { return std::holds_alternative<ResultAck>(each.message); }));
  EXPECT_TRUE(std::ranges::any_of(
      step.after_commit, [](const Outgoing& each) { return std::holds_alternative<ResultAck>(each.message); }));
  EXPECT_TRUE(std::ranges::any_of(step.writes, [](const StoreOp& op) { return std::holds_alternative<PutNode>(op); }));
}

}  // namespace
}  // namespace lightmill
