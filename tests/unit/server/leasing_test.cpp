#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

using LeasingTest = test::CoordinatorTest;

TEST_F(LeasingTest, AnIdleWorkerGetsALeaseAsSoonAsAJobIsThere) {
  const SessionId session = connect("w");
  EXPECT_TRUE(got<LeaseGrant>(session).empty());
  submit(spec());
  ASSERT_FALSE(got<LeaseGrant>(session).empty());
  EXPECT_EQ(got<JobDescription>(session).size(), 1u);
  EXPECT_EQ(*got<JobDescription>(session)[0].settings.scene, "scene");
}

TEST_F(LeasingTest, AWorkerOfACancelledJobGetsTheNextOneAtOnce) {
  const JobId first = submit(spec("r1", 1000, {0, 0, 512, 512}));
  const SessionId session = connect("w");
  const std::size_t before = got<LeaseGrant>(session).size();
  ASSERT_GT(before, 0u);
  EXPECT_TRUE(coordinator->cancel(first, now, unix_ms(), effects).ok());
  flush();
  const JobId second = submit(spec("r2", 1000));
  ASSERT_GT(got<LeaseGrant>(session).size(), before);  // without waiting for a heartbeat
  EXPECT_EQ(got<LeaseGrant>(session)[before].unit.job, second);
}

TEST_F(LeasingTest, UnitsInFlightAreBounded) {
  submit(spec("r1", 1000, {0, 0, 1024, 1024}));
  const SessionId session = connect("w");
  EXPECT_EQ(got<LeaseGrant>(session).size(), 2u);
  finish(session, got<LeaseGrant>(session)[0]);
  EXPECT_EQ(got<LeaseGrant>(session).size(), 3u);
  EXPECT_EQ(coordinator->workers(now)[0].leases, 2u);
}

TEST_F(LeasingTest, UnitsGrowToASecondOfTheWorkersMeasuredSpeed) {
  const JobId job = submit(spec("r1", 100'000, {0, 0, 512, 512}));
  const SessionId session = connect("w", 2);
  constexpr double kSecondsPerPixelSample = 1e-6;
  for (std::size_t i = 0; i < 40; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(session).at(i);
    const double tile_seconds = kSecondsPerPixelSample * 4096 * static_cast<double>(grant.unit.range.count());
    EXPECT_LE(tile_seconds, 1.0);
    EXPECT_LE(tile_seconds * static_cast<double>(grant.unit.tiles.size()) / 2, 1.0 + 1e-9);
    for (const TileId tile : grant.unit.tiles) {
      say(session, result(grant, tile, tile_seconds));
    }
  }
  const LeaseGrant last = got<LeaseGrant>(session).at(40);
  const double seconds = kSecondsPerPixelSample * 4096 * static_cast<double>(last.unit.range.count()) *
                         static_cast<double>(last.unit.tiles.size()) / 2;
  EXPECT_GT(seconds, 0.5);
  EXPECT_EQ(status(job).counters.results_duplicate, 0u);
}

TEST_F(LeasingTest, AnUnrenewedLeaseExpiresAndIsLeasedAgain) {
  const JobId job = submit(spec("r1", 1));
  const SessionId silent = connect("silent");
  const std::vector<LeaseGrant> lost = got<LeaseGrant>(silent);
  const Duration most = limits.lease_duration * 6 / 10;
  pass(most);
  say(silent, WorkerHeartbeat{{lost[0].lease}});
  pass(most);
  EXPECT_EQ(status(job).counters.leases_lost, lost.size() - 1);  // the heartbeat renewed one
  pass(most);
  EXPECT_EQ(status(job).counters.leases_lost, lost.size());
  EXPECT_EQ(got<LeaseGrant>(silent).size(), lost.size());  // it has been silent since, so it gets no more
  const SessionId other = connect("other");
  std::size_t tiles = 0;
  for (const LeaseGrant& grant : got<LeaseGrant>(other)) {
    tiles += grant.unit.tiles.size();
  }
  EXPECT_EQ(tiles, 2u);
  // The lost lease's result is still accepted.
  finish(silent, lost[0]);
  work(other);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(LeasingTest, ResultsRenewAllLeasesOfTheirWorker) {
  // On a slow connection heartbeats queue behind results.
  const JobId job = submit(spec("r1", 1000, {0, 0, 1024, 1024}));
  const SessionId session = connect("w", 4);
  const LeaseGrant first = got<LeaseGrant>(session).at(0);
  for (const TileId tile : first.unit.tiles) {
    pass(std::chrono::seconds(6));
    say(session, result(first, tile));
  }
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LeasingTest, UnknownLeasesInHeartbeatsAreCancelled) {
  const SessionId session = connect("w");
  say(session, WorkerHeartbeat{{LeaseId{12345}}});
  ASSERT_EQ(got<LeaseCancel>(session).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(session)[0].leases, std::vector<LeaseId>{LeaseId{12345}});
}

TEST_F(LeasingTest, ALostLeaseHalvesTheNextUnit) {
  submit(spec("r1", 100'000, {0, 0, 1024, 1024}));
  SessionId session = connect("w");
  std::size_t i = 0;
  const auto unit_seconds = [](const LeaseGrant& grant) {
    return 1e-6 * 4096 * static_cast<double>(grant.unit.range.count()) * static_cast<double>(grant.unit.tiles.size());
  };
  const auto finish_next = [&] {
    const LeaseGrant grant = got<LeaseGrant>(session).at(i++);
    for (const TileId tile : grant.unit.tiles) {
      say(session, result(grant, tile, unit_seconds(grant) / static_cast<double>(grant.unit.tiles.size())));
    }
  };
  for (int n = 0; n < 30; ++n) {
    finish_next();
  }
  EXPECT_GT(unit_seconds(got<LeaseGrant>(session).at(i + 1)), 0.5);
  pass(limits.lease_duration);
  const std::size_t before = got<LeaseGrant>(session).size();
  say(session, WorkerHeartbeat{});
  ASSERT_GT(got<LeaseGrant>(session).size(), before);
  EXPECT_LE(unit_seconds(got<LeaseGrant>(session)[before]), 0.25 + 1e-9);  // two were lost
}

TEST_F(LeasingTest, TheFirstLeasesFitTheRateOfResults) {
  limits.result_bytes_per_second = 4e6;
  restart({});
  std::vector<SessionId> sessions;
  for (int i = 0; i < 100; ++i) {
    sessions.push_back(connect(fmt::format("w{}", i)));
  }
  submit(spec("r1", 100'000, {0, 0, 256, 256}));
  const auto out = [&] {
    std::vector<std::pair<SessionId, LeaseGrant>> grants;
    for (const SessionId session : sessions) {
      for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
        grants.emplace_back(session, grant);
      }
    }
    return grants;
  };
  // A result has 96 KiB. Half a second takes 21, and the one beyond.
  const auto before = out();
  EXPECT_EQ(before.size(), 21u);
  finish(before[0].first, before[0].second);
  const auto after = out();
  EXPECT_GE(after.size(), 200u) << "each worker has one to work on and one ahead";
  for (const auto& [session, grant] : after) {
    EXPECT_EQ(grant.unit.tiles.size(), 1u);
  }
}

TEST_F(LeasingTest, TheLastUnitsOfATimedJobAreShorterIfTheirResultsFitTheRate) {
  // A sample of a tile takes 0.1 s, and a worker has one unit ahead. The result is the number of samples in the last
  // unit that is given within 20.3 s.
  const auto last_unit = [&] {
    restart({});
    sent.clear();
    JobSpec timed = spec("r1", 0, {0, 0, 64, 64});
    timed.goal.seconds = 20.3;
    const JobId job = submit(timed);
    const SessionId session = connect("w");
    std::vector<std::uint64_t> counts;
    for (std::size_t done = 0; done < got<LeaseGrant>(session).size(); ++done) {
      const LeaseGrant grant = got<LeaseGrant>(session)[done];
      counts.push_back(grant.unit.range.count());
      const double seconds = 0.1 * static_cast<double>(counts.back());
      pass(from_seconds(seconds));
      say(session, result(grant, grant.unit.tiles.at(0), seconds));
    }
    EXPECT_EQ(status(job).state, JobState::done);
    EXPECT_GT(counts.size(), 4u);
    EXPECT_GE(*std::ranges::max_element(counts), counts.back());
    return std::pair(*std::ranges::max_element(counts), counts.back());
  };
  EXPECT_EQ(last_unit(), std::pair(std::uint64_t{8}, std::uint64_t{4})) << "a second, and half of it";
  limits.result_bytes_per_second = (96 + 22) * 1024 / 2.0;  // a result in two seconds, so units of up to four
  EXPECT_EQ(last_unit(), std::pair(std::uint64_t{32}, std::uint64_t{32}));
}

TEST_F(LeasingTest, EqualJobsShareTheWorkerAndPriorityGoesFirst) {
  const JobId first = submit(spec("r1", 10'000, {0, 0, 256, 256}));
  const SessionId session = connect("w");
  std::size_t at = 0;
  const auto work_some = [&](int leases) {
    std::map<JobId, double> seconds;
    for (int n = 0; n < leases; ++n) {
      const LeaseGrant grant = got<LeaseGrant>(session).at(at++);
      const double tile_seconds = 1e-6 * 4096 * static_cast<double>(grant.unit.range.count());
      for (const TileId tile : grant.unit.tiles) {
        say(session, result(grant, tile, tile_seconds));
      }
      seconds[grant.unit.job] += tile_seconds * static_cast<double>(grant.unit.tiles.size());
    }
    return seconds;
  };
  work_some(30);
  const JobId second = submit(spec("r2", 10'000, {0, 0, 256, 256}));
  work_some(20);
  std::map<JobId, double> share = work_some(60);
  EXPECT_NEAR(share[first] / (share[first] + share[second]), 0.5, 0.1);
  JobSpec urgent = spec("r3", 10'000, {0, 0, 256, 256});
  urgent.priority = 1;
  const JobId third = submit(urgent);
  work_some(2);  // what was out before
  share = work_some(20);
  EXPECT_EQ(share.size(), 1u);
  EXPECT_TRUE(share.contains(third));

  ASSERT_TRUE(coordinator->set_priority(second, 2, now, effects).ok());
  work_some(2);
  share = work_some(20);
  EXPECT_EQ(share.size(), 1u);
  EXPECT_TRUE(share.contains(second));
  ASSERT_TRUE(coordinator->set_priority(second, 0, now, effects).ok());
  ASSERT_TRUE(coordinator->set_priority(third, 0, now, effects).ok());
  work_some(20);  // a job that joins starts from the least share, so others need not wait
  share = work_some(90);
  for (const JobId job : {first, second, third}) {
    EXPECT_NEAR(share[job] / (share[first] + share[second] + share[third]), 1. / 3, 0.1) << job.value;
  }
}

TEST_F(LeasingTest, ANewJobsFirstPictureComesNext) {
  submit(spec("r1", 10'000, {0, 0, 256, 256}));
  const SessionId session = connect("w");
  for (std::size_t i = 0; i < 20; ++i) {
    finish(session, got<LeaseGrant>(session).at(i));
  }
  const std::size_t before = got<LeaseGrant>(session).size();
  const JobId second = submit(spec("r2", 10'000, {0, 0, 256, 256}));
  finish(session, got<LeaseGrant>(session).at(20));
  EXPECT_EQ(got<LeaseGrant>(session).at(before).unit.job, second);
}

TEST_F(LeasingTest, IdleWorkersCopyLateUnits) {
  const JobId job = submit(spec("r1", 1));
  const SessionId slow = connect("slow");
  const std::vector<LeaseGrant> originals = got<LeaseGrant>(slow);
  const SessionId idle = connect("idle");
  EXPECT_TRUE(got<LeaseGrant>(idle).empty());
  EXPECT_EQ(status(job).counters.copies_leased, 0u);
  pass(std::chrono::seconds(1));
  ASSERT_FALSE(got<LeaseGrant>(idle).empty());
  EXPECT_EQ(status(job).counters.copies_leased, got<LeaseGrant>(idle)[0].unit.tiles.size());
  for (int i = 0; i < 20 && status(job).state != JobState::done; ++i) {
    say(slow, WorkerHeartbeat{{originals[0].lease}});
    pass(std::chrono::milliseconds(200));
    work(idle);
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(got<LeaseCancel>(slow).size(), originals.size());
  finish(slow, originals[0]);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LeasingTest, ReturnedTilesGoToOthersAtOnce) {
  const JobId job = submit(spec("r1", 1));
  const SessionId leaving = connect("leaving");
  const SessionId other = connect("other");
  say(leaving, WorkerDraining{});
  for (const LeaseGrant& grant : got<LeaseGrant>(leaving)) {
    say(leaving, WorkerReturn{grant.lease});
  }
  work(other);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
}

TEST_F(LeasingTest, AnInvalidHelloEndsItsSession) {
  const SessionId session{next_session++};
  coordinator->worker_connected(session, WorkerHello{}, now, effects);
  flush();
  EXPECT_EQ(got<Dismissal>(session).size(), 1u);
  say(session, WorkerHeartbeat{});
  EXPECT_TRUE(coordinator->workers(now).empty());
}

}  // namespace
}  // namespace lightmill
