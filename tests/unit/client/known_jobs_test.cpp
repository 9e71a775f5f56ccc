#include "client/cli/known_jobs.h"

#include <gtest/gtest.h>

namespace lightmill::cli {
namespace {

v1::Job job(std::uint64_t id, const std::string& trace_id, std::int64_t submitted_unix_ms) {
  v1::Job made;
  made.set_id(id);
  made.set_trace_id(trace_id);
  made.set_submitted_unix_ms(submitted_unix_ms);
  return made;
}

TEST(KnownJobs, AJobIsKnownInEveryState) {
  KnownJobs known("farm:7350");
  EXPECT_FALSE(known.has(1));
  v1::Job seen = job(1, "a", 1000);
  EXPECT_TRUE(known.meet(seen).ok());
  EXPECT_TRUE(known.has(1));
  seen.set_state(v1::JOB_STATE_DONE);
  seen.set_render_digest("digest");
  seen.set_name("renamed");
  EXPECT_TRUE(known.meet(seen).ok());
  EXPECT_TRUE(known.meet(job(2, "b", 1000)).ok());
}

TEST(KnownJobs, AnotherJobWithTheSameNumberIsRefused) {
  KnownJobs known("farm:7350");
  ASSERT_TRUE(known.meet(job(1, "a", 1000)).ok());
  const Status other = known.meet(job(1, "b", 1000));
  EXPECT_EQ(other.code(), StatusCode::kAborted);
  EXPECT_EQ(
      message_of(other),
      "job 1 is not the same job as before: another farm answers at farm:7350 now, or the farm has lost its data");
  EXPECT_FALSE(known.meet(job(1, "a", 2000)).ok()) << "the same request, submitted to a farm that had lost it";
  EXPECT_TRUE(known.meet(job(1, "a", 1000)).ok());
}

TEST(KnownJobs, AKnownJobThatIsNotFoundIsGone) {
  KnownJobs known("farm:7350");
  ASSERT_TRUE(known.meet(job(1, "a", 1000)).ok());
  const Status gone = known.about(1, not_found("there is no job 1"));
  EXPECT_EQ(gone.code(), StatusCode::kAborted);
  EXPECT_EQ(message_of(gone),
            "the farm at farm:7350 no longer has job 1: the job was deleted, the farm has lost its data, or another "
            "farm answers there now");
  EXPECT_EQ(known.about(2, not_found("there is no job 2")).code(), StatusCode::kNotFound);
  EXPECT_TRUE(known.about(1, ok_status()).ok());
  EXPECT_EQ(known.about(1, unavailable("silence")).code(), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace lightmill::cli
