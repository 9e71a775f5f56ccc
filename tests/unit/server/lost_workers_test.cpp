// Workers that are lost repeatedly with the same work.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

class LostWorkersTest : public test::CoordinatorTest {
 protected:
  /// Connects a worker that gets its leases and is lost.
  std::vector<LeaseGrant> lose_a_worker() {
    const SessionId session = connect(fmt::format("worker-{}", ++lost_));
    const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
    coordinator->worker_disconnected(session, now, effects);
    flush();
    pass(limits.disconnect_grace + std::chrono::milliseconds(1));
    return grants;
  }

  /// A job whose leases wait for commits, as those of an error goal do.
  static JobSpec spec_to_error(PixelRect crop) {
    JobSpec job = spec("r1", 0, crop);
    job.goal.error = 0.001;
    return job;
  }

 private:
  int lost_ = 0;
};

TEST_F(LostWorkersTest, ATileThatKillsAllItsWorkersFailsItsJobByName) {
  const JobId job = submit(spec("r1", 4, {0, 0, 64, 64}));
  for (std::uint32_t i = 0; i < limits.losses_before_alone + limits.losses_alone; ++i) {
    ASSERT_EQ(status(job).state, i == 0 ? JobState::queued : JobState::running);
    ASSERT_FALSE(lose_a_worker().empty()) << i;
  }
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(status(job).reason,
            "5 workers were lost in a row, the last ones (worker-3, worker-4, worker-5) while they had nothing to do "
            "but to render samples [0, 1) of the 64x64 pixels at 0, 0");
}

TEST_F(LostWorkersTest, ASuspectedTileIsRenderedAlone) {
  JobSpec first = spec("r1", 64, {0, 0, 256, 64});
  first.priority = 1;
  const JobId job = submit(first);
  submit(spec("r2", 64, {0, 0, 256, 64}));
  for (std::uint32_t i = 0; i < limits.losses_before_alone; ++i) {
    lose_a_worker();
  }
  const SessionId session = connect("survivor", 4);
  ASSERT_EQ(got<LeaseGrant>(session).size(), 1u);
  const LeaseGrant alone = got<LeaseGrant>(session)[0];
  EXPECT_EQ(alone.unit.tiles.size(), 1u);
  work(session);  // the tile was not at fault, so work continues as usual
  EXPECT_EQ(status(job).state, JobState::done);
  std::size_t most_tiles = 0;
  for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
    most_tiles = std::max(most_tiles, grant.unit.tiles.size());
  }
  EXPECT_GT(most_tiles, 1u);
}

TEST_F(LostWorkersTest, AResultClearsASuspectedTile) {
  const JobId job = submit(spec("r1", 64, {0, 0, 64, 64}));
  for (int round = 0; round < 4; ++round) {
    for (std::uint32_t i = 0; i < limits.losses_before_alone + limits.losses_alone - 1; ++i) {
      lose_a_worker();
    }
    const SessionId session = connect(fmt::format("survivor-{}", round));
    const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
    ASSERT_EQ(grants.size(), 1u) << status(job).reason;
    finish(session, grants[0]);
    say(session, WorkerDraining{});
    for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
      say(session, WorkerReturn{grant.lease});
    }
    coordinator->worker_disconnected(session, now, effects);
    flush();
  }
  EXPECT_NE(status(job).state, JobState::failed);
}

TEST_F(LostWorkersTest, ALossAfterAResultOfTheTileIsTheFirstInARow) {
  const JobId job = submit(spec("r1", 64, {0, 0, 64, 64}));
  const SessionId slow = connect("slow");
  const std::vector<LeaseGrant> held = got<LeaseGrant>(slow);
  ASSERT_FALSE(held.empty());
  const auto lose_one = [&] {
    lose_a_worker();
    WorkerHeartbeat heartbeat;
    for (const LeaseGrant& grant : got<LeaseGrant>(slow)) {
      heartbeat.leases.push_back(grant.lease);
    }
    say(slow, heartbeat);
  };
  for (std::uint32_t i = 0; i < limits.losses_before_alone; ++i) {
    lose_one();
  }
  const SessionId alone = connect("alone");
  ASSERT_EQ(got<LeaseGrant>(alone).size(), 1u);
  say(slow, result(held[0], TileId{0}));
  coordinator->worker_disconnected(alone, now, effects);
  flush();
  pass(limits.disconnect_grace + std::chrono::milliseconds(1));
  for (std::uint32_t i = 1; i < limits.losses_before_alone + limits.losses_alone; ++i) {
    ASSERT_EQ(status(job).state, JobState::running) << i << ": " << status(job).reason;
    lose_one();
  }
  EXPECT_EQ(status(job).state, JobState::failed);
}

TEST_F(LostWorkersTest, ABrokenConnectionMakesNoTileSuspect) {
  const JobId job = submit(spec("r1", 4, {0, 0, 64, 64}));
  for (int i = 0; i < 20; ++i) {  // the same process, which never got its leases
    connect("w");
  }
  EXPECT_EQ(status(job).state, JobState::running);
}

TEST_F(LostWorkersTest, LeasesThatTheStoreDelaysAreNotLost) {
  const JobId job = submit(spec("r1", 4, {0, 0, 64, 64}));
  const auto second = [&](SessionId session, Effects& waiting) {
    now += std::chrono::seconds(1);
    coordinator->worker_message(session, WorkerHeartbeat{}, now, unix_ms(), waiting);
    coordinator->tick(now, unix_ms(), waiting);
  };
  Effects waiting;
  for (std::uint32_t i = 0; i < 2 * (limits.losses_before_alone + limits.losses_alone); ++i) {
    const SessionId session{next_session++};
    const WorkerHello hello{fmt::format("w-{}", i), "host", 1, 1, "class-a", kRendererVersion, {}, false};
    waiting.after_commit.clear();
    coordinator->worker_connected(session, hello, now, waiting);
    ASSERT_FALSE(leases_granted(waiting.after_commit).empty()) << status(job).reason;
    for (int seconds = 0; seconds < 30; ++seconds) {
      second(session, waiting);
    }
    coordinator->worker_disconnected(session, now, waiting);
    for (int seconds = 0; seconds < 5; ++seconds) {
      second(session, waiting);
    }
  }
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);

  // A worker's time starts when its lease is stored.
  const SessionId session{next_session++};
  waiting.after_commit.clear();
  coordinator->worker_connected(session, {"last", "host", 1, 1, "class-a", kRendererVersion, {}, false}, now, waiting);
  const std::vector<LeaseId> leases = leases_granted(waiting.after_commit);
  ASSERT_FALSE(leases.empty());
  const auto lease_seconds = static_cast<int>(to_seconds(limits.lease_duration));
  for (int seconds = 0; seconds < 3 * lease_seconds; ++seconds) {
    second(session, waiting);
  }
  EXPECT_EQ(status(job).active_seconds, 0);
  const Time sent = now;
  second(session, waiting);
  coordinator->grants_sent(leases, sent);  // the coordinator learns of it a second later
  EXPECT_EQ(status(job).active_seconds, 1);
  for (int seconds = 2; seconds < lease_seconds; ++seconds) {
    second(session, waiting);
    ASSERT_EQ(status(job).counters.leases_lost, 0u) << seconds;
  }
  second(session, waiting);
  EXPECT_EQ(status(job).counters.leases_lost, leases.size());
}

TEST_F(LostWorkersTest, LeasesSentToABrokenStreamMakeNoTileSuspect) {
  const JobId job = submit(spec_to_error({0, 0, 64, 64}));
  for (std::uint32_t i = 0; i < 2 * (limits.losses_before_alone + limits.losses_alone); ++i) {
    const SessionId session{next_session++};
    Effects waiting;
    coordinator->worker_connected(
        session, {fmt::format("w-{}", i), "host", 1, 1, "class-a", kRendererVersion, {}, false}, now, waiting);
    const std::vector<LeaseId> leases = leases_granted(waiting.after_commit);
    ASSERT_FALSE(leases.empty()) << status(job).reason;
    coordinator->worker_disconnected(session, now, waiting);
    coordinator->grants_sent(leases, now);  // the worker has left
    now += limits.disconnect_grace + std::chrono::milliseconds(1);
    coordinator->tick(now, unix_ms(), waiting);
  }
  EXPECT_NE(status(job).state, JobState::failed) << status(job).reason;
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LostWorkersTest, UnsentLeasesDoNotExpire) {
  const JobId job = submit(spec_to_error({0, 0, 128, 128}));
  const SessionId session = connect("w", 4);
  const std::vector<LeaseGrant> held = got<LeaseGrant>(session);
  ASSERT_FALSE(held.empty());
  Effects waiting;  // what follows is not stored
  for (const TileId tile : held.front().unit.tiles) {
    coordinator->worker_message(session, result(held.front(), tile), now, unix_ms(), waiting);
  }
  const std::vector<LeaseId> later = leases_granted(waiting.after_commit);
  ASSERT_FALSE(later.empty());
  std::vector<LeaseId> named;
  for (std::size_t i = 1; i < held.size(); ++i) {
    named.push_back(held[i].lease);
  }
  for (int i = 0; i < 60; ++i) {
    now += std::chrono::seconds(1);
    coordinator->worker_message(session, WorkerHeartbeat{named}, now, unix_ms(), waiting);
    coordinator->tick(now, unix_ms(), waiting);
  }
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LostWorkersTest, AWorkerThatSendsDamagedResultsMakesNoTileSuspect) {
  const JobId job = submit(spec("r1", 4, {0, 0, 64, 64}));
  for (std::uint32_t i = 0; i < 2 * (limits.losses_before_alone + limits.losses_alone); ++i) {
    const SessionId session = connect(fmt::format("garbage-{}", i));
    const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
    ASSERT_FALSE(grants.empty()) << status(job).reason;
    WorkerResult damaged = result(grants[0], grants[0].unit.tiles.front());
    damaged.node.values.front() = std::numeric_limits<float>::quiet_NaN();
    say(session, damaged);
    coordinator->worker_disconnected(session, now, effects);
    flush();
    pass(limits.disconnect_grace + std::chrono::milliseconds(1));
  }
  EXPECT_EQ(status(job).state, JobState::running);
}

TEST_F(LostWorkersTest, APilotThatKillsAllItsWorkersFailsItsJob) {
  JobSpec piloted = spec("r1", 4);
  piloted.settings.method = "auto";
  MethodNotes notes;
  notes.candidates = {"path", "caustic"};
  const Result<JobId> job = coordinator->submit(piloted, now, unix_ms(), effects, notes);
  ASSERT_TRUE(job.ok());
  flush();
  for (int i = 0; i < 5; ++i) {
    ASSERT_NE(status(*job).state, JobState::failed);
    lose_a_worker();
  }
  EXPECT_EQ(status(*job).state, JobState::failed);
  EXPECT_NE(status(*job).reason.find("to try the job's methods"), std::string::npos);
}

TEST_F(LostWorkersTest, ASilentWorkerIsDisconnected) {
  const SessionId silent = connect("silent"), other = connect("other");
  for (Duration at{}; at < limits.silence + limits.silence / 2; at += limits.heartbeat_interval) {
    EXPECT_TRUE(closed.empty() || at >= limits.silence);
    pass(limits.heartbeat_interval);
    say(other, WorkerHeartbeat{});
  }
  EXPECT_EQ(closed, std::vector<SessionId>{silent});
  ASSERT_EQ(coordinator->workers(now).size(), 1u);
  EXPECT_EQ(coordinator->workers(now)[0].name, "other");
  coordinator->worker_disconnected(silent, now, effects);  // its stream ends at last
  say(silent, WorkerHeartbeat{});
  EXPECT_EQ(coordinator->workers(now).size(), 1u);
  connect("silent");
  EXPECT_EQ(coordinator->workers(now).size(), 2u);
}

TEST_F(LostWorkersTest, APausedCoordinatorLosesNoWorker) {
  const JobId job = submit(spec("r1", 64, {0, 0, 256, 64}));
  const SessionId session = connect("a");
  const std::vector<LeaseGrant> before = got<LeaseGrant>(session);
  ASSERT_FALSE(before.empty());
  stand_still(std::chrono::minutes(10));
  EXPECT_TRUE(closed.empty());
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  work(session);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LostWorkersTest, APauseIsDetectedWhenAWorkerConnectsFirst) {
  const JobId job = submit(spec("r1", 64, {0, 0, 256, 64}));
  const SessionId session = connect("a");
  now += std::chrono::minutes(10);
  connect("b");
  stand_still({});
  EXPECT_TRUE(closed.empty());
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  work(session);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LostWorkersTest, ASilentWorkerIsLostAfterAPause) {
  const JobId job = submit(spec("r1", 64, {0, 0, 256, 64}));
  connect("a");
  stand_still(std::chrono::minutes(10));
  pass(limits.lease_duration + std::chrono::seconds(1));
  EXPECT_GT(status(job).counters.leases_lost, 0u);
}

TEST_F(LostWorkersTest, AnOverloadedCoordinatorLosesNoSilentWorker) {
  const JobId job = submit(spec("r1", 64, {0, 0, 256, 64}));
  const SessionId session = connect("a");
  connect("b");
  const Duration step_time = limits.lease_duration / 4;
  for (Duration at{}; at < 3 * limits.silence; at += step_time) {
    coordinator->note_backlog(now);
    pass(step_time);
  }
  EXPECT_TRUE(closed.empty());
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  coordinator->worker_disconnected(session, now, effects);  // a broken stream still loses its worker
  coordinator->note_backlog(now);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  const std::uint64_t lost = status(job).counters.leases_lost;
  EXPECT_GT(lost, 0u);
  pass(limits.lease_duration);
  EXPECT_GT(status(job).counters.leases_lost, lost) << "it can listen again, and hears nothing";
  pass(limits.silence);
  EXPECT_EQ(closed.size(), 1u);
}

TEST_F(LostWorkersTest, AStartWithOldJobsIsNotAPause) {
  limits.keep_ended = std::chrono::hours(1);
  restart({});
  StoredState stored;
  stored.jobs.resize(1);
  stored.jobs[0].record.id = JobId{1};
  stored.jobs[0].record.spec = spec();
  restart(std::move(stored));
  coordinator->tick(now, unix_ms(), effects);
  for (const Note& note : effects.notes) {
    EXPECT_EQ(note.text.find("was stopped"), std::string::npos) << note.text;
  }
}

}  // namespace
}  // namespace lightmill
