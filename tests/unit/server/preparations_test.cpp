// Pilots and the preparation of scenes: one owner's do not keep the workers from the jobs of others.
#include "tests/unit/server/pilot_fixture.h"

namespace lightmill::test {
namespace {

class PreparationTest : public PilotTest {
 protected:
  JobSpec of(const std::string& owner, const std::string& request, std::uint64_t samples = 64) {
    JobSpec job = spec(request, samples, {0, 0, 256, 64});
    job.owner = owner;
    return job;
  }
  JobId submit_of(const std::string& owner) { return submit(of(owner, fmt::format("r{}", ++requests))); }
  JobId submit_pilot_of(const std::string& owner) {
    return submit_undecided(of(owner, fmt::format("r{}", ++requests)));
  }
  /// Time passes while the workers send heartbeats with all their leases and pilots that were not cancelled.
  void wait_with(const std::vector<SessionId>& sessions, Duration time, double pilot_cpu_seconds = 0) {
    for (const Time until = now + time; now < until;) {
      pass(std::chrono::seconds(1));
      for (const SessionId session : sessions) {
        WorkerHeartbeat heartbeat;
        std::set<LeaseId> cancelled;
        for (const LeaseCancel& cancel : got<LeaseCancel>(session)) {
          cancelled.insert(cancel.leases.begin(), cancel.leases.end());
        }
        for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
          heartbeat.leases.push_back(grant.lease);
        }
        for (const PilotGrant& grant : got<PilotGrant>(session)) {
          heartbeat.leases.push_back(grant.lease);
          if (pilot_cpu_seconds > 0) {
            heartbeat.at_work.push_back({grant.lease, TileId{0}, pilot_cpu_seconds});
          }
        }
        std::erase_if(heartbeat.leases, [&](LeaseId lease) { return cancelled.contains(lease); });
        say(session, std::move(heartbeat));
      }
    }
  }
  std::size_t leases_of(SessionId session, JobId job) const {
    const std::vector<LeaseGrant> grants = got<LeaseGrant>(session);
    return static_cast<std::size_t>(
        std::ranges::count_if(grants, [&](const LeaseGrant& grant) { return grant.unit.job == job; }));
  }
  int requests = 0;
};

TEST_F(PreparationTest, AWorkerRunsOnePilotAtATime) {
  const SessionId worker = connect("a");
  for (int i = 0; i < 3; ++i) {
    submit_pilot_of("ann");
  }
  EXPECT_EQ(got<PilotGrant>(worker).size(), 1u);
  report(worker, 0);
  EXPECT_EQ(got<PilotGrant>(worker).size(), 2u);
}

TEST_F(PreparationTest, APilotBeyondItsCpuTimeIsEndedByName) {
  const JobId job = submit_pilot_of("ann");
  const SessionId a = connect("a");
  const auto identity = [&](const std::string& name) {
    const SessionId session{next_session++};
    WorkerHello hello{name, name, 1, 1, "class-a", kRendererVersion, {}, false, name};
    coordinator->worker_connected(session, hello, now, effects);
    flush();
    return session;
  };
  const LeaseId lease = pilot(a).lease;
  wait_with({a}, from_seconds(limits.tile_cpu_seconds), 1e6);
  EXPECT_TRUE(got<LeaseCancel>(a).empty()) << "no thread had more time than has passed";
  wait_with({a}, std::chrono::seconds(2), limits.tile_cpu_seconds + 1);
  ASSERT_EQ(got<LeaseCancel>(a).size(), 1u);
  EXPECT_EQ(got<LeaseCancel>(a)[0].leases, std::vector<LeaseId>{lease});
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  const std::string reason = "the pilot of job 1 (path, ao) took more than 600 s of CPU time";
  EXPECT_EQ(status(job).reason, "waits for a worker of another identity: worker a refused it: " + reason);
  EXPECT_EQ(got<PilotGrant>(a).size(), 1u);
  const SessionId b = identity("b");
  wait_with({b}, from_seconds(limits.tile_cpu_seconds + 2), limits.tile_cpu_seconds + 1);
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(status(job).reason, "workers a and b: " + reason);
}

TEST_F(PreparationTest, ScenesThatTakeLongDelayTheirOwnersNextOnes) {
  limits.leases_per_worker = 1;
  restart({});
  const SessionId worker = connect("a");
  const JobId first = submit_of("ann");
  std::vector<JobId> more;
  for (int i = 0; i < 20; ++i) {
    more.push_back(submit_of("ann"));
  }
  const JobId bobs = submit_of("bob");
  ASSERT_EQ(leases_of(worker, first), 1u);
  wait_with({worker}, std::chrono::seconds(5));
  say(worker, WorkerRefusal{first, "it takes too long to prepare", true});
  EXPECT_EQ(leases_of(worker, bobs), 1u);
  EXPECT_EQ(leases_of(worker, more[0]), 0u);
  // Each owner gets the same time, however many jobs one has.
  worked[worker] = 1;
  double given = 0;
  for (std::size_t i = 1; i < 400 && leases_of(worker, more[0]) == 0; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(worker).at(i);
    for (const TileId tile : grant.unit.tiles) {
      pass(std::chrono::milliseconds(100));
      say(worker, result(grant, tile, 0.1));
      given += 0.1;
    }
  }
  EXPECT_NEAR(given, 5, 2);
}

TEST_F(PreparationTest, AScenesPreparationMakesWayForAnotherOwner) {
  const SessionId a = connect("a"), b = connect("b");
  std::vector<JobId> anns;
  for (int i = 0; i < 10; ++i) {
    anns.push_back(submit_of("ann"));
  }
  wait_with({a, b}, std::chrono::seconds(30));
  const std::size_t cancelled = got<LeaseCancel>(a).size() + got<LeaseCancel>(b).size();
  EXPECT_EQ(cancelled, 0u) << "it waits for no worker";
  const JobId bobs = submit_of("bob");
  wait_with({a, b}, std::chrono::seconds(2));
  EXPECT_EQ((leases_of(a, bobs) > 0) + (leases_of(b, bobs) > 0), 1) << "the other worker continues";
  const SessionId gets = leases_of(a, bobs) > 0 ? a : b;
  EXPECT_FALSE(got<LeaseCancel>(gets).empty());
  EXPECT_TRUE(got<LeaseCancel>(gets == a ? b : a).empty());
  for (const JobId job : anns) {
    EXPECT_EQ(status(job).counters.leases_lost, 0u);
  }
}

TEST_F(PreparationTest, APilotOfOneOwnerMakesWayForAnotherOwner) {
  const SessionId a = connect("a");
  for (int i = 0; i < 10; ++i) {
    submit_pilot_of("ann");
  }
  wait_with({a}, std::chrono::seconds(5));
  const JobId bobs = submit_of("bob");
  EXPECT_GT(leases_of(a, bobs), 0u) << "a worker has room besides a pilot";
  EXPECT_TRUE(got<LeaseCancel>(a).empty());
  wait_with({a}, std::chrono::seconds(7));
  ASSERT_EQ(got<LeaseCancel>(a).size(), 1u) << "but it prepares one thing at a time";
  EXPECT_EQ(got<LeaseCancel>(a)[0].leases, std::vector<LeaseId>{got<PilotGrant>(a)[0].lease});
}

TEST_F(PreparationTest, EachAttemptHasMoreTimeThanTheLast) {
  limits.leases_per_worker = 1;
  restart({});
  const SessionId a = connect("a");
  const JobId anns = submit_of("ann");
  // Bob's jobs never bring anything either.
  submit_of("bob");
  Time since = now;
  std::vector<double> turns;
  std::size_t cancels = 0;
  while (turns.size() < 8) {
    wait_with({a}, std::chrono::seconds(1));
    if (got<LeaseCancel>(a).size() > cancels) {
      cancels = got<LeaseCancel>(a).size();
      turns.push_back(to_seconds(now - since));
      since = now;
    }
    ASSERT_LT(to_seconds(now - since), 700);
  }
  EXPECT_GT(turns.back(), 60) << "so each of them is prepared in the end";
  EXPECT_GT(leases_of(a, anns), 2u);
}

}  // namespace
}  // namespace lightmill::test
