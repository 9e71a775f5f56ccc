// Numbers that a worker claims, and that cannot be checked. A false one harms no job and no other worker for long.
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

class ClaimsTest : public AuditTest {
 protected:
  JobId submit_unaudited(const std::string& request) {
    JobSpec job = spec(request, 1 << 14, {0, 0, 256, 256});
    job.audit_share = 0;
    return submit(job);
  }
  double worker_seconds(JobId job) const { return status(job).worker_seconds; }
  SessionId connect_claiming(const std::string& name, std::uint32_t threads) {
    return connect_as({name, name, 1, threads, "class-a", kRendererVersion, {}, false, name});
  }
  /// Time passes while the workers send heartbeats with all leases that they were ever granted.
  void hold_with(const std::vector<SessionId>& sessions, Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(std::min<Duration>(limits.heartbeat_interval, until - now));
      for (const SessionId session : sessions) {
        WorkerHeartbeat heartbeat;
        for (const LeaseGrant& grant : got<LeaseGrant>(session)) {
          heartbeat.leases.push_back(grant.lease);
        }
        say(session, std::move(heartbeat));
      }
    }
  }
};

TEST_F(ClaimsTest, AResultTakesNoLongerThanItsLeaseIsOpen) {
  const JobId job = submit_unaudited("r1");
  const SessionId liar = connect_on("m1", "liar");
  const LeaseGrant grant = got<LeaseGrant>(liar).at(0);
  say(liar, result(grant, grant.unit.tiles.front(), 1e6));
  EXPECT_EQ(status(job).counters.results_merged, 1u);
  EXPECT_LE(worker_seconds(job), 15);
  const LeaseGrant later = got<LeaseGrant>(liar).back();
  pass_with({liar}, std::chrono::seconds(10));
  const double before = worker_seconds(job);
  say(liar, result(later, later.unit.tiles.front(), 20));
  EXPECT_DOUBLE_EQ(worker_seconds(job) - before, 20);
}

TEST_F(ClaimsTest, ARepeatedResultTakesNoTime) {
  const JobId job = submit_unaudited("r1");
  const SessionId liar = connect_on("m1", "liar");
  const LeaseGrant grant = got<LeaseGrant>(liar).at(0);
  const WorkerResult sent_result = result(grant, grant.unit.tiles.front(), 1);
  for (int i = 0; i < 10; ++i) {
    say(liar, sent_result);
  }
  EXPECT_EQ(status(job).counters.results_duplicate, 9u);
  EXPECT_EQ(worker_seconds(job), 1);
}

TEST_F(ClaimsTest, APilotTakesNoLongerThanItsLeaseIsOpen) {
  JobSpec undecided = spec("r1");
  undecided.settings.method = "auto";
  const JobId job =
      *coordinator->submit(undecided, now, unix_ms(), effects, {true, {"two do"}, {}, {"path", "caustic"}});
  const SessionId liar = connect_on("m1", "liar");
  say(liar, PilotReport{got<PilotGrant>(liar).at(0).lease, 0, {"it is cheaper"}, 1e6, Allocation()});
  EXPECT_EQ(status(job).spec.settings.method, "path");
  EXPECT_LE(worker_seconds(job), 15);
}

TEST_F(ClaimsTest, ManyWorkersOfOneIdentityCountAsOneForTheRateOfResults) {
  std::vector<SessionId> honest, liars;
  for (const char* const name : {"a", "b"}) {
    honest.push_back(connect_with(name, "1", "machine", "host"));
  }
  for (const char* const name : {"1", "2", "3", "4", "5"}) {
    liars.push_back(connect_with("liar", name, "machine", "host"));
  }
  submit_unaudited("r1");
  const LeaseGrant grant = got<LeaseGrant>(honest[0]).at(0);
  say(honest[0], result(grant, grant.unit.tiles.front()));
  pass(std::chrono::milliseconds(1900));
  for (const SessionId session : honest) {
    say(session, WorkerHeartbeat{{}, std::chrono::milliseconds(10)});
  }
  for (const SessionId session : liars) {
    say(session, WorkerHeartbeat{{}, std::chrono::seconds(10)});
  }
  pass(std::chrono::milliseconds(200));
  say(honest[0], WorkerHeartbeat{});
  EXPECT_EQ(coordinator->gauges(now).results_rate, limits.result_bytes_per_second);
}

TEST_F(ClaimsTest, ClaimedThreadsAreLimitedByReceivedResults) {
  JobSpec large = spec("r1", 1 << 14, {0, 0, 4096, 4096});
  large.audit_share = 0;
  submit(large);
  const SessionId liar = connect_claiming("liar", 4096);
  const auto tiles_held = [&] {
    std::size_t tiles = 0;
    for (std::size_t i = worked[liar]; i < got<LeaseGrant>(liar).size(); ++i) {
      tiles += got<LeaseGrant>(liar)[i].unit.tiles.size();
    }
    return tiles;
  };
  EXPECT_LE(tiles_held(), limits.tiles_at_first);
  answer_one(liar);
  EXPECT_LE(tiles_held(), 2 * limits.tiles_at_first);
}

// It takes a second for each sample of a tile, and says that it takes none.
TEST_F(ClaimsTest, AClaimedSpeedIsLimitedByReceivedResults) {
  JobSpec large = spec("r1", 1 << 20, {0, 0, 128, 128});
  large.audit_share = 0;
  const JobId job = submit(large);
  const SessionId liar = connect_claiming("liar", 1);
  double slowest = 0;
  const Time end = now + std::chrono::minutes(20);
  for (std::size_t i = 0; i < got<LeaseGrant>(liar).size() && now < end; ++i) {
    const LeaseGrant grant = got<LeaseGrant>(liar)[i];
    const Time start = now;
    for (const TileId tile : grant.unit.tiles) {
      hold_with({liar}, from_seconds(static_cast<double>(grant.unit.range.count())));
      say(liar, result(grant, tile, 1e-9));
    }
    slowest = std::max(slowest, to_seconds(now - start));
  }
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  EXPECT_GT(slowest, 16);
  EXPECT_LE(slowest, 128) << "twice what it delivers in a minute";
}

TEST_F(ClaimsTest, ThreadsDoNotMakeTheUnitsOfOthersLonger) {
  JobSpec large = spec("r1", 1 << 14, {0, 0, 1024, 1024});
  large.audit_share = 0;
  submit(large);
  const SessionId honest = connect_claiming("honest", 1), liar = connect_claiming("liar", 4096);
  double longest = 0;
  for (std::size_t i = 0; i < 200 && i < got<LeaseGrant>(honest).size(); ++i) {
    const LeaseGrant grant = got<LeaseGrant>(honest)[i];
    const double tile_seconds = 0.1 * static_cast<double>(grant.unit.range.count());
    for (const TileId tile : grant.unit.tiles) {
      hold_with({honest, liar}, from_seconds(tile_seconds));
      say(honest, result(grant, tile, tile_seconds));
    }
    longest = std::max(longest, tile_seconds * static_cast<double>(grant.unit.tiles.size()));
  }
  EXPECT_GT(longest, 0.5);
  EXPECT_LE(longest, limits.unit_seconds + 1e-9);
}

TEST_F(ClaimsTest, AnAuditedJobDoesNotStartInAClassOfOneIdentity) {
  const SessionId liar = connect_on("m0", "a liar", 1, "its own");
  const SessionId honest = connect_on("m1", "honest"), other = connect_on("m2", "other");
  const JobId job = submit_audited();
  EXPECT_EQ(status(job).fingerprint_class, "class-a");
  EXPECT_TRUE(got<LeaseGrant>(liar).empty());
  answer(honest);
  answer(other);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(status(job).counters.results_audited, 1u);
  submit_unaudited("unaudited");
  EXPECT_FALSE(got<LeaseGrant>(liar).empty()) << "it may render unaudited work";
}

TEST_F(ClaimsTest, WorkersOfOneIdentityDoNotMakeAClassThatCanAudit) {
  for (const char* const name : {"1", "2"}) {
    WorkerHello hello{fmt::format("a liar/{}", name), "host", 1, 1, "its own", kRendererVersion, {}, false, "machine"};
    hello.identity = "a liar";
    connect_as(hello);
  }
  connect_with("x", "1", "machine", "host");
  connect_with("y", "1", "machine", "host");
  EXPECT_EQ(status(submit_audited()).fingerprint_class, "class-a");
}

TEST_F(ClaimsTest, AJobThatNoMachineCanAuditStartsAnywhere) {
  const SessionId lone = connect_on("m0", "a lone one", 1, "class-b"), honest = connect_on("m1", "honest");
  const JobId job = submit_audited();
  EXPECT_EQ(status(job).fingerprint_class, "class-b");
  answer(lone);
  EXPECT_EQ(status(job).state, JobState::done);
  const SessionId other = connect_on("m2", "other");
  const JobId heavy = submit_audited(1, "r2");
  EXPECT_EQ(status(heavy).fingerprint_class, "class-a");
  say(honest, WorkerRefusal{heavy, "too large", true});
  say(other, WorkerRefusal{heavy, "too large", true});
  EXPECT_EQ(status(heavy).fingerprint_class, "class-b") << "no other worker can render it";
}

// Otherwise a job without results would seem to have the least time, and would always be served first.
TEST_F(ClaimsTest, TimeWithoutAResultCountsForItsJob) {
  limits.leases_per_worker = 1;
  restart({});
  const JobId endless = submit_unaudited("endless");
  const SessionId worker = connect_on("m1", "w");
  ASSERT_EQ(got<LeaseGrant>(worker).at(0).unit.job, endless);
  const JobId other = submit_unaudited("other");
  for (const Time until = now + limits.result_timeout(); now < until;) {
    pass(limits.heartbeat_interval);
    say(worker, WorkerHeartbeat{{got<LeaseGrant>(worker).back().lease}});
  }
  ASSERT_EQ(status(endless).counters.leases_lost, 1u);
  worked[worker] = 1;
  for (std::size_t i = 1; i < 50; ++i) {
    ASSERT_EQ(got<LeaseGrant>(worker).size(), i + 1);
    ASSERT_EQ(got<LeaseGrant>(worker)[i].unit.job, other) << i;
    answer_one(worker);
  }
}

}  // namespace
}  // namespace lightmill::test
