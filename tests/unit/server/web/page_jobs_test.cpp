// Deletion of jobs with their page.
#include "server/web/page_jobs.h"

#include <gtest/gtest.h>

#include "server/operations/operation.h"

namespace lightmill {
namespace {

class PassingClock final : public Clock {
 public:
  Time now() const override { return now_; }
  std::int64_t unix_milliseconds() const override { return 0; }
  void pass(Duration time) { now_ += time; }

 private:
  Time now_{std::chrono::seconds(1'000)};
};

class PageJobsTest : public ::testing::Test {
 protected:
  static Call call_by(const std::string& name) {
    return {{name, {Role::submit}, Proof::token, 0, "1"}, find_operation("SubmitJob")->rpc, "10.0.0.1:1"};
  }
  void submit(const std::string& page, std::uint64_t job, const std::string& caller = "ada") {
    jobs.submission_callback(page, call_by(caller))(JobId{job});
  }
  void pass(Duration time) {
    clock.pass(time);
    jobs.tick();
  }

  PassingClock clock;
  std::vector<std::uint64_t> discarded;
  bool deletes = true;
  PageJobs jobs{[](const std::function<void()>& task) { task(); }, clock,
                [this](const Call& call, JobId job, const std::function<void(bool)>& done) {
                  EXPECT_EQ(call.rpc.method, "DeleteJob");
                  discarded.push_back(job.value);
                  done(deletes);
                }};
};

TEST_F(PageJobsTest, JobsEndWhenThePageIsDisconnectedForLong) {
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok()) << "a second connection";
  submit("p", 1);
  submit("p", 2);
  jobs.disconnected("p");
  pass(2 * PageJobs::kTimeout);
  EXPECT_TRUE(discarded.empty()) << "one is left";
  jobs.disconnected("p");
  pass(PageJobs::kTimeout - std::chrono::nanoseconds(1));
  EXPECT_TRUE(discarded.empty());
  pass(std::chrono::nanoseconds(1));
  EXPECT_EQ(discarded, (std::vector<std::uint64_t>{1, 2}));
  pass(PageJobs::kTimeout);
  EXPECT_EQ(discarded.size(), 2u) << "once";
}

TEST_F(PageJobsTest, JobsStayWhenThePageReconnectsInTime) {
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  submit("p", 1);
  jobs.disconnected("p");
  pass(PageJobs::kTimeout / 2);
  EXPECT_TRUE(jobs.check("p", call_by("ada")).ok()) << "jobs that it submits now end with it, too";
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  pass(2 * PageJobs::kTimeout);
  EXPECT_TRUE(discarded.empty());
  jobs.disconnected("p");
  pass(PageJobs::kTimeout);
  EXPECT_EQ(discarded, std::vector<std::uint64_t>{1});
}

TEST_F(PageJobsTest, JobsEndAtOnceWhenThePageIsAlreadyGone) {
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  EXPECT_TRUE(jobs.check("p", call_by("ada")).ok());
  jobs.disconnected("p");
  submit("p", 1);
  EXPECT_EQ(discarded, std::vector<std::uint64_t>{1});
  EXPECT_EQ(jobs.check("p", call_by("ada")).code(), StatusCode::kFailedPrecondition);
}

TEST_F(PageJobsTest, AFailedDeletionIsRetried) {
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  jobs.disconnected("p");
  deletes = false;
  submit("p", 1);
  pass(std::chrono::seconds(1));
  EXPECT_EQ(discarded, (std::vector<std::uint64_t>{1, 1}));
  deletes = true;
  pass(std::chrono::seconds(1));
  pass(std::chrono::seconds(1));
  EXPECT_EQ(discarded, (std::vector<std::uint64_t>{1, 1, 1}));
}

TEST_F(PageJobsTest, APageBelongsToOneCaller) {
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  EXPECT_EQ(jobs.connected("p", call_by("bob")).code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(jobs.check("p", call_by("bob")).code(), StatusCode::kFailedPrecondition);
  submit("p", 1, "bob");
  EXPECT_EQ(discarded, std::vector<std::uint64_t>{1}) << "ada cannot keep it";
  EXPECT_EQ(jobs.connected(std::string(65, 'p'), call_by("ada")).code(), StatusCode::kInvalidArgument);
}

TEST_F(PageJobsTest, TheOldestOfTooManyJobsIsDeleted) {
  EXPECT_TRUE(jobs.connected("p", call_by("ada")).ok());
  for (std::uint64_t job = 1; job <= PageJobs::kMaxJobs + 1; ++job) {
    submit("p", job);
  }
  EXPECT_EQ(discarded, std::vector<std::uint64_t>{1});
}

}  // namespace
}  // namespace lightmill
