// Answers to queries: the status of jobs, and lists of jobs and workers.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using test::CoordinatorTest;

TEST_F(CoordinatorTest, AnEndIsShownOnceItsRowIsStored) {
  stores_ends = false;
  const JobId job = submit(spec());
  const SessionId session = connect("w");
  const auto count = [&](const JobFilter& filter) { return coordinator->count_jobs(filter); };
  const auto expect_running = [&] {
    const JobStatus shown = status(job);
    EXPECT_EQ(shown.state, JobState::running);
    EXPECT_EQ(shown.reason, "");
    EXPECT_EQ(shown.reached, GoalLimit::none);
    EXPECT_EQ(shown.finished_unix_ms, 0);
    EXPECT_EQ(count({.unfinished = true}), 1u);
    EXPECT_EQ(count({.states = {JobState::running}}), 1u);
    EXPECT_EQ(count({.states = {JobState::done}}), 0u);
    EXPECT_EQ(coordinator->gauges(now).jobs[static_cast<std::size_t>(JobState::running)], 1u);
  };
  work(session);
  EXPECT_EQ(coordinator->decided_status(job, now)->state, JobState::done);
  expect_running();
  coordinator->hold("the disk is full", now, effects);
  EXPECT_EQ(status(job).reason, "the disk is full");
  coordinator->hold("", now, effects);

  // The job is extended and ends again. The commit of the first end says nothing about the second.
  ASSERT_TRUE(coordinator->extend(job, {8}, now, effects).ok());
  flush();
  work(session);
  ASSERT_EQ(ends_unstored, (std::vector{job, job}));
  const std::uint64_t version = coordinator->version(job);
  coordinator->ends_stored(std::vector{job});
  expect_running();
  EXPECT_EQ(coordinator->version(job), version);
  coordinator->ends_stored(std::vector{job});
  EXPECT_GT(coordinator->version(job), version) << "watchers get it";
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).reason, "reached 8 samples per pixel");
  EXPECT_EQ(status(job).finished_unix_ms, unix_ms());
  EXPECT_EQ(count({.unfinished = true}), 0u);
  EXPECT_EQ(count({.states = {JobState::done}}), 1u);
}

TEST_F(CoordinatorTest, APausedJobThatIsCancelledIsShownAsPausedUntilItIsStored) {
  stores_ends = false;
  const JobId job = submit(spec());
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  EXPECT_EQ(status(job).state, JobState::paused);
  store_ends();
  EXPECT_EQ(status(job).state, JobState::cancelled);
}

TEST_F(CoordinatorTest, VersionsGrowWithEveryChange) {
  const JobId job = submit(spec());
  std::uint64_t version = coordinator->version(job);
  const auto grew = [&] { return std::exchange(version, coordinator->version(job)) < version; };
  const SessionId session = connect("w");
  EXPECT_TRUE(grew());  // it runs
  finish(session, got<LeaseGrant>(session)[0]);
  EXPECT_TRUE(grew());
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  EXPECT_TRUE(grew());
  EXPECT_FALSE(grew());
}

TEST_F(CoordinatorTest, TheErrorOfAMethodWithEqualSamplesIsUnknown) {
  const SessionId session = connect("w");
  for (const auto& [method, estimated] :
       {std::pair("path", true), {"photon-map", false}, {"photon-map:caustic", false}}) {
    JobSpec job_spec = spec(method, 64);
    job_spec.settings.method = method;
    const JobId job = submit(job_spec);
    work(session);
    EXPECT_EQ(status(job).state, JobState::done) << method;
    EXPECT_EQ(status(job).error.known, estimated) << method;
    EXPECT_EQ(!status(job).history.empty(), estimated) << method;
  }
}

TEST_F(CoordinatorTest, StatusShowsProgressAndSpeed) {
  const JobId job = submit(spec("r1", 64));
  const SessionId session = connect("w", 2);
  EXPECT_FALSE(status(job).error.known);
  EXPECT_EQ(status(job).eta_seconds, -1);
  for (int i = 0; i < 4; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(session)[i];
    for (const TileId tile : grant.unit.tiles) {
      const double seconds = 0.1 * static_cast<double>(grant.unit.range.count());
      now += from_seconds(seconds);
      say(session, result(grant, tile, seconds));
    }
  }
  const JobStatus seen = status(job);
  EXPECT_TRUE(seen.error.known);
  EXPECT_EQ(seen.samples_wanted, 128u * 64 * 64);
  EXPECT_GT(seen.samples_done, 0u);
  EXPECT_GT(seen.samples_per_second, 0);
  const double rest = 0.1 * static_cast<double>(seen.samples_wanted - seen.samples_done) / (64 * 64);
  EXPECT_NEAR(seen.eta_seconds, rest, 0.1 * rest);
  EXPECT_GT(seen.worker_seconds, 0);
  ASSERT_EQ(coordinator->workers(now).size(), 1u);
  EXPECT_EQ(coordinator->workers(now)[0].threads, 2u);
  EXPECT_EQ(coordinator->jobs(now).size(), 1u);
}

TEST_F(CoordinatorTest, WorkersAndQuarantinedOnesAreListedByName) {
  std::map<std::string, SessionId> sessions;
  for (const std::string name : {"e", "b", "a", "d", "c"}) {
    sessions[name] = connect(name);
  }
  for (const std::string name : {"b", "d"}) {
    ASSERT_TRUE(coordinator->quarantine_worker(name, "put there by ada", false, now, effects).ok());
    coordinator->worker_disconnected(sessions[name], now, effects);
  }
  flush();
  std::vector<std::string> names;
  for (std::string after;;) {
    const std::vector<WorkerStatus> page = coordinator->workers(now, {after, 2});
    if (page.empty()) {
      break;
    }
    EXPECT_LE(page.size(), 2u);
    for (const WorkerStatus& worker : page) {
      names.push_back(worker.name);
      EXPECT_EQ(worker.connected, worker.name != "b" && worker.name != "d");
    }
    after = names.back();
  }
  EXPECT_EQ(names, (std::vector<std::string>{"a", "b", "c", "d", "e"}));
  EXPECT_EQ(coordinator->workers(now).size(), 5u);
}

TEST_F(CoordinatorTest, ListsTheNewestJobsOfAFilter) {
  std::vector<JobId> submitted;
  for (const std::string name : {"a", "b", "a", "b", "a"}) {
    JobSpec job = spec(fmt::format("r{}", submitted.size()));
    job.owner = name;
    submitted.push_back(submit(job));
  }
  const auto listed = [&](const JobFilter& filter) {
    std::vector<JobId> ids;
    for (const JobStatus& job : coordinator->jobs(now, filter)) {
      ids.push_back(job.id);
    }
    return ids;
  };
  const auto chosen = [&](std::initializer_list<std::size_t> places) {
    std::vector<JobId> ids;
    for (const std::size_t place : places) {
      ids.push_back(submitted[place]);
    }
    return ids;
  };
  const auto of_a = [](const JobRecord& job) { return job.spec.owner == "a"; };
  EXPECT_EQ(listed({}), chosen({4, 3, 2, 1, 0}));
  EXPECT_EQ(listed({.most = 2}), chosen({4, 3}));
  EXPECT_EQ(listed({.before = submitted[3], .most = 2}), chosen({2, 1}));
  EXPECT_EQ(listed({.most = 2, .admits = of_a}), chosen({4, 2}));
  EXPECT_EQ(listed({.before = submitted[2], .admits = of_a}), chosen({0}));
  EXPECT_EQ(listed({.before = submitted[0]}), chosen({}));
  Effects effects;
  ASSERT_TRUE(coordinator->cancel(submitted[4], now, 0, effects).ok());
  coordinator->ends_stored(ends_in(effects.writes));
  ASSERT_TRUE(coordinator->pause(submitted[3], now, effects).ok());
  EXPECT_EQ(listed({.most = 2, .unfinished = true}), chosen({3, 2}));
  EXPECT_EQ(listed({.unfinished = true, .admits = of_a}), chosen({2, 0}));
  EXPECT_EQ(coordinator->count_jobs({}), 5u);
  EXPECT_EQ(coordinator->count_jobs({.most = 1, .unfinished = true, .admits = of_a}), 2u) << "all pages";
}

}  // namespace
}  // namespace lightmill
