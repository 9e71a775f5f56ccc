#include "server/domain/job_figures.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using test::CoordinatorTest;

TEST(GoalText, HasSingularsAndPlurals) {
  EXPECT_EQ(describe(Goal{.samples = 1}), "1 sample per pixel");
  EXPECT_EQ(describe(Goal{.samples = 64, .seconds = 1}), "64 samples per pixel or 1 second");
  EXPECT_EQ(describe(Goal{.seconds = 1.5, .error = 0.01}), "1.5 seconds or error 0.01");
}

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
  ASSERT_TRUE(coordinator->submit(spec(), now, unix_ms(), effects).ok());
  for (const Outgoing& each : effects.now) {
    EXPECT_FALSE(std::holds_alternative<LeaseGrant>(each.message));
    EXPECT_FALSE(std::holds_alternative<JobDescription>(each.message));
  }
  EXPECT_TRUE(std::ranges::any_of(
      effects.after_commit, [](const Outgoing& each) { return std::holds_alternative<LeaseGrant>(each.message); }));
  const auto* row = std::get_if<PutJob>(&effects.writes.back());
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->record.fingerprint_class, "class-a");
  EXPECT_EQ(row->record.state, JobState::running);
}

TEST_F(CoordinatorTest, AcknowledgesOnlyAfterTheCommitOfTheNode) {
  submit(spec());
  const SessionId session = connect("w");
  const LeaseGrant grant = got<LeaseGrant>(session).at(0);
  coordinator->worker_message(session, result(grant, grant.unit.tiles[0]), now, unix_ms(), effects);
  EXPECT_TRUE(std::ranges::none_of(
      effects.now, [](const Outgoing& each) { return std::holds_alternative<ResultAck>(each.message); }));
  EXPECT_TRUE(std::ranges::any_of(
      effects.after_commit, [](const Outgoing& each) { return std::holds_alternative<ResultAck>(each.message); }));
  EXPECT_TRUE(
      std::ranges::any_of(effects.writes, [](const StoreOp& op) { return std::holds_alternative<PutNode>(op); }));
}

TEST_F(CoordinatorTest, TheSameRequestIsOneJob) {
  const JobId first = submit(spec("r1"));
  EXPECT_EQ(submit(spec("r1")), first);
  EXPECT_NE(submit(spec("r2")), first);
  // Also after a restart, because the stored job has the id.
  StoredState stored{2, {{std::get<PutJob>(writes[0]).record, {}}}, 3};
  restart(std::move(stored));
  EXPECT_EQ(submit(spec("r1")), first);
  EXPECT_EQ(submit(spec("r3")), JobId{3});
}

TEST_F(CoordinatorTest, AnInvalidJobIsRefusedWithItsField) {
  const auto error_of = [&](const std::function<void(JobSpec&)>& change) {
    JobSpec job = spec("bad");
    change(job);
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), effects);
    EXPECT_EQ(id.status().code(), StatusCode::kInvalidArgument);
    return message_of(id.status());
  };
  EXPECT_NE(error_of([](JobSpec& job) { job.request_id.clear(); }).find("request_id"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.goal = {}; }).find("goal"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.goal.samples = kMaxSamples + 1; }).find("goal.samples"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.goal.seconds = NAN; }).find("goal.seconds"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.settings.width = 0; }).find("settings"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.settings.crop.x = 1; }).find("settings.crop"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.settings.crop.width = 2147483647; }).find("settings.crop"),
            std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.settings.layers.clear(); }).find("settings.layers"), std::string::npos);
  EXPECT_NE(error_of([](JobSpec& job) { job.settings.method = "magic"; }).find("settings.method"), std::string::npos);
  const std::string too_far = error_of([](JobSpec& job) {
    job.settings.method = "whitted";
    job.settings.max_bounces = 129;
  });
  EXPECT_NE(too_far.find("settings.max_bounces: whitted follows at most 128 bounces, got 129"), std::string::npos)
      << too_far;
  EXPECT_NE(error_of([](JobSpec& job) { job.settings.renderer_version = ""; }).find("renderer_version"),
            std::string::npos);
}

TEST_F(CoordinatorTest, TheQueueIsBounded) {
  limits.max_jobs = 2;
  limits.film_bytes = 3 * 128 * 64 * 24;
  restart({});
  submit(spec("r1"));
  submit(spec("r2"));
  EXPECT_EQ(coordinator->submit(spec("r3"), now, 0, effects).status().code(), StatusCode::kResourceExhausted);
  ASSERT_TRUE(coordinator->cancel(JobId{1}, now, 0, effects).ok());
  ASSERT_TRUE(coordinator->remove(JobId{1}, now, effects).ok());
  EXPECT_EQ(coordinator->submit(spec("r3", 4, {0, 0, 192, 128}), now, 0, effects).status().code(),
            StatusCode::kResourceExhausted);
  EXPECT_TRUE(coordinator->submit(spec("r3"), now, 0, effects).ok());
}

TEST_F(CoordinatorTest, AFilmThatNeverFitsIsBadInput) {
  limits.film_bytes = 3 * 128 * 64 * 24;
  restart({});
  const Status too_large = coordinator->submit(spec("r1", 4, {0, 0, 256, 128}), now, 0, effects).status();
  EXPECT_EQ(too_large.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(message_of(too_large).find("--films-gib"), std::string::npos) << message_of(too_large);
  EXPECT_EQ(message_of(too_large).find("delete"), std::string::npos);
  // A time can end a job at any count, and most counts take many nodes.
  JobSpec timed = spec("r2", 0);
  timed.goal.seconds = 60;
  EXPECT_EQ(coordinator->submit(timed, now, 0, effects).status().code(), StatusCode::kInvalidArgument);
  timed.goal.samples = 14;  // at most 3 nodes a tile: of 7, 11, 13 or 14 samples
  EXPECT_TRUE(coordinator->submit(timed, now, 0, effects).ok());
}

TEST_F(CoordinatorTest, ExtendingHasTheLimitsOfSubmitting) {
  limits.film_bytes = 3 * 128 * 64 * 24;
  restart({});
  const JobId job = submit(spec("r1", 4));
  submit(spec("r2", 4));
  EXPECT_EQ(coordinator->extend(job, {15}, now, effects).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(coordinator->extend(job, {7}, now, effects).code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(status(job).spec.goal.samples, 4u);
  EXPECT_TRUE(coordinator->extend(job, {6}, now, effects).ok());
}

TEST_F(CoordinatorTest, CancelStopsWorkersAndDropsLateResults) {
  const JobId job = submit(spec());
  const SessionId session = connect("w");
  const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
  const WorkerResult late = result(grants[0], grants[0].unit.tiles[0]);
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  EXPECT_EQ(got<LeaseCancel>(session).size(), grants.size());
  const std::size_t writes_before = writes.size();
  say(session, late);
  EXPECT_EQ(writes.size(), writes_before);
  EXPECT_EQ(got<ResultAck>(session).size(), 1u);
  EXPECT_EQ(status(job).samples_done, 0u);
  EXPECT_EQ(coordinator->cancel(job, now, 0, effects).code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(coordinator->cancel(JobId{99}, now, 0, effects).code(), StatusCode::kNotFound);
}

TEST_F(CoordinatorTest, PausedTimeDoesNotCount) {
  JobSpec job_spec = spec("r1", 0);
  job_spec.goal.seconds = 10;
  const JobId job = submit(job_spec);
  const SessionId session = connect("w");
  pass(std::chrono::seconds(1));
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  flush();
  const std::size_t grants = got<LeaseGrant>(session).size();
  for (std::size_t i = 0; i < grants; ++i) {
    finish(session, got<LeaseGrant>(session)[i]);  // results of granted leases are accepted
  }
  EXPECT_EQ(got<LeaseGrant>(session).size(), grants);
  for (int i = 0; i < 10; ++i) {
    pass(std::chrono::seconds(10));
    say(session, WorkerHeartbeat{});
  }
  EXPECT_EQ(status(job).state, JobState::paused);
  EXPECT_NEAR(status(job).active_seconds, 1, 1e-9);
  ASSERT_TRUE(coordinator->resume(job, now, effects).ok());
  flush();
  EXPECT_GT(got<LeaseGrant>(session).size(), grants);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(coordinator->resume(job, now, effects).code(), StatusCode::kFailedPrecondition);
}

TEST_F(CoordinatorTest, AJobWhoseTimeIsUpTakesPendingResultsAndIsDone) {
  JobSpec job_spec = spec("r1", 0);
  job_spec.goal.seconds = 5;
  const JobId job = submit(job_spec);
  const SessionId session = connect("w");
  finish(session, got<LeaseGrant>(session)[0]);
  EXPECT_EQ(status(job).eta_seconds, 5);
  pass(std::chrono::seconds(5) + std::chrono::milliseconds(1));
  EXPECT_EQ(status(job).state, JobState::running);
  const std::size_t grants = got<LeaseGrant>(session).size();
  for (std::size_t i = 1; i < grants; ++i) {
    finish(session, got<LeaseGrant>(session)[i]);
  }
  EXPECT_EQ(got<LeaseGrant>(session).size(), grants);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reason, "reached 5 seconds");
  EXPECT_GT(status(job).min_tile_samples, 0u);
  EXPECT_EQ(status(job).finished_unix_ms, unix_ms());
}

TEST_F(CoordinatorTest, ADoneJobCanBeExtended) {
  const JobId job = submit(spec("r1", 100));
  const SessionId session = connect("w");
  work(session);
  ASSERT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(coordinator->extend(job, {100}, now, effects).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(coordinator->extend(job, {kMaxSamples + 1}, now, effects).code(), StatusCode::kInvalidArgument);
  ASSERT_TRUE(coordinator->extend(job, {300}, now, effects).ok());
  flush();
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).finished_unix_ms, 0);
  work(session);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(coordinator->film(job)->min_samples(), 300u);
  EXPECT_EQ(status(job).counters.results_duplicate, 0u);
  ASSERT_TRUE(coordinator->cancel(submit(spec("r2")), now, 0, effects).ok());
  EXPECT_EQ(coordinator->extend(JobId{2}, {300}, now, effects).code(), StatusCode::kFailedPrecondition);
}

TEST_F(CoordinatorTest, APriorityIsStoredUntilTheJobHasEnded) {
  const JobId job = submit(spec("r1", 100));
  flush();
  ASSERT_TRUE(coordinator->set_priority(job, -7, now, effects).ok());
  EXPECT_EQ(std::get<PutJob>(effects.writes.back()).record.spec.priority, -7);
  EXPECT_EQ(status(job).spec.priority, -7);
  flush();
  ASSERT_TRUE(coordinator->set_priority(job, -7, now, effects).ok());
  EXPECT_TRUE(effects.writes.empty());  // unchanged
  ASSERT_TRUE(coordinator->cancel(job, now, 0, effects).ok());
  EXPECT_EQ(coordinator->set_priority(job, 1, now, effects).code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(coordinator->set_priority(JobId{99}, 1, now, effects).code(), StatusCode::kNotFound);
}

TEST_F(CoordinatorTest, OnlyEndedJobsAreDeleted) {
  const JobId job = submit(spec());
  EXPECT_EQ(coordinator->remove(job, now, effects).code(), StatusCode::kFailedPrecondition);
  ASSERT_TRUE(coordinator->cancel(job, now, 0, effects).ok());
  ASSERT_TRUE(coordinator->remove(job, now, effects).ok());
  EXPECT_TRUE(std::holds_alternative<DeleteJobRows>(effects.writes.back()));
  EXPECT_EQ(coordinator->status(job, now).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(coordinator->film(job), nullptr);
  EXPECT_EQ(coordinator->version(job), 0u);
}

TEST_F(CoordinatorTest, ResumesFromTheStoredState) {
  const JobId job = submit(spec("r1", 4));
  const SessionId session = connect("w");
  finish(session, got<LeaseGrant>(session)[0]);
  // The rows of a store: the job and the film's forest.
  StoredState stored;
  stored.epoch = 2;
  stored.next_job_id = 2;
  stored.jobs.push_back({std::get<PutJob>(*std::ranges::find_if(writes,
                                                                [](const StoreOp& op) {
                                                                  const auto* put = std::get_if<PutJob>(&op);
                                                                  return put != nullptr &&
                                                                         put->record.state == JobState::running;
                                                                }))
                             .record,
                         {}});
  const Film* film = coordinator->film(job);
  for (std::uint32_t tile = 0; tile < 2; ++tile) {
    for (const NodePtr& node : film->forest(TileId{tile})) {
      stored.jobs[0].nodes.push_back({TileId{tile}, node});
    }
  }
  const std::uint64_t before = status(job).samples_done;
  restart(std::move(stored));
  EXPECT_EQ(status(job).samples_done, before);
  const SessionId again = connect("w");
  EXPECT_TRUE(got<LeaseGrant>(again).empty());  // others may still reconnect with what they hold
  pass(limits.restart_grace);
  ASSERT_FALSE(got<LeaseGrant>(again).empty());
  for (const LeaseGrant& grant : got<LeaseGrant>(again)) {
    EXPECT_EQ(grant.lease.value >> 32, 2u);
    EXPECT_GT(grant.unit.range.first(), 0u);
  }
  work(again);
  EXPECT_EQ(status(job).state, JobState::done);
}

}  // namespace
}  // namespace lightmill
