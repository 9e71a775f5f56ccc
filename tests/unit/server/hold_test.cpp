// Holds of the farm, and deletion of jobs that ended long ago.
#include <gtest/gtest.h>

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

class HoldTest : public CoordinatorTest {
 protected:
  void hold(const std::string& why) {
    coordinator->hold(why, now, effects);
    flush();
  }
};

TEST_F(HoldTest, AHoldStopsLeasesAndIsTheReasonOfJobs) {
  hold("waits for space");
  const JobId job = submit(spec());
  const SessionId worker = connect("w");
  EXPECT_EQ(status(job).reason, "waits for space");
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  EXPECT_EQ(status(job).reason, "") << "a user paused it";
  ASSERT_TRUE(coordinator->resume(job, now, effects).ok());
  pass(std::chrono::seconds(10));
  EXPECT_TRUE(got<LeaseGrant>(worker).empty());
  hold("");
  EXPECT_EQ(status(job).reason, "");
  work(worker);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(HoldTest, PendingResultsAreAccepted) {
  const JobId job = submit(spec("r1", 1));
  const SessionId worker = connect("w");
  ASSERT_FALSE(got<LeaseGrant>(worker).empty());
  hold("waits for space");
  EXPECT_EQ(status(job).reason, "waits for space");
  work(worker);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(HoldTest, JobsThatEndedLongAgoAreDeleted) {
  limits.keep_ended = std::chrono::hours(10);
  restart({});
  const JobId ended = submit(spec("a")), waiting = submit(spec("b"));
  ASSERT_TRUE(coordinator->cancel(ended, now, unix_ms(), effects).ok());
  flush();
  writes.clear();
  pass(std::chrono::hours(10) - std::chrono::seconds(1));
  EXPECT_TRUE(coordinator->status(ended, now).ok());
  ASSERT_TRUE(coordinator->next_deadline().has_value());
  pass(*coordinator->next_deadline() - now);
  EXPECT_FALSE(coordinator->status(ended, now).ok());
  EXPECT_TRUE(coordinator->status(waiting, now).ok());
  ASSERT_EQ(writes.size(), 1u);
  EXPECT_EQ(std::get<DeleteJobRows>(writes[0]).job, ended);
  EXPECT_EQ(submit(spec("a")).value, waiting.value + 1) << "its request is forgotten too";
}

TEST_F(HoldTest, JobsStayWithoutALimit) {
  const JobId ended = submit(spec());
  ASSERT_TRUE(coordinator->cancel(ended, now, unix_ms(), effects).ok());
  flush();
  pass(std::chrono::hours(100'000));
  EXPECT_TRUE(coordinator->status(ended, now).ok());
}

TEST_F(HoldTest, JobsOfOneUserAreLimited) {
  limits.max_jobs_per_owner = 1;
  restart({});
  JobSpec first = spec("a"), second = spec("b"), other = spec("c");
  first.owner = second.owner = "ada";
  other.owner = "bob";
  submit(first);
  submit(other);
  const Result<JobId> refused = coordinator->submit(second, now, unix_ms(), effects);
  EXPECT_EQ(refused.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(refused.status()),
            "the farm keeps at most 1 jobs of one user, 'ada': delete some that have ended");
}

}  // namespace
}  // namespace lightmill::test
