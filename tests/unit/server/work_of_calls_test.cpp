// Work and memory that one caller can cause. Work is counted in allocations.
#include "tests/support/allocations.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

class WorkOfCalls : public CoordinatorTest {
 protected:
  void connect_other(const std::string& name) {
    coordinator->worker_connected(SessionId{next_session++}, {name, "host", 1, 1, "class of " + name, "old", {}, false},
                                  now, effects);
    flush();
  }
};

TEST_F(WorkOfCalls, RowsAndDescriptionsShareTheScene) {
  JobSpec large = spec();
  large.settings.scene = std::string(1 << 20, 's');
  large.settings.assets = std::vector<Sha256>(1'000);
  const JobId job = submit(large);
  for (int priority = 1; priority <= 10; ++priority) {
    ASSERT_TRUE(coordinator->set_priority(job, priority, now, effects).ok());
  }
  const SessionId session = connect("w");
  say(session, WorkerReturn{got<LeaseGrant>(session).at(0).lease});
  std::set<const void*> scenes, assets;
  int rows = 0;
  for (const StoreOp& op : writes) {
    if (const auto* const put = std::get_if<PutJob>(&op)) {
      ++rows;
      scenes.insert(put->record.spec.settings.scene->data());
      assets.insert(put->record.spec.settings.assets->data());
    }
  }
  const std::vector<JobDescription> descriptions = got<JobDescription>(session);
  for (const JobDescription& description : descriptions) {
    scenes.insert(description.settings.scene->data());
    assets.insert(description.settings.assets->data());
  }
  EXPECT_GE(rows, 11);
  EXPECT_GE(descriptions.size(), 2u);
  EXPECT_EQ(scenes, std::set<const void*>{large.settings.scene->data()});
  EXPECT_EQ(assets, std::set<const void*>{large.settings.assets->data()});
}

TEST_F(WorkOfCalls, AListLooksAtEachWorkerOnce) {
  constexpr int kJobs = 100, kWorkers = 100;
  for (int i = 0; i < kJobs; ++i) {
    submit(spec(fmt::format("r{}", i)));
  }
  const auto list = [&] {
    const std::uint64_t before = allocations;
    const std::vector<JobStatus> jobs = coordinator->jobs(now);
    EXPECT_EQ(jobs.size(), std::size_t{kJobs});
    EXPECT_EQ(jobs.front().reason, jobs.back().reason);
    EXPECT_NE(jobs.front().reason.find(": a has renderer old"), std::string::npos) << jobs.front().reason;
    return allocations - before;
  };
  connect_other("a");
  const std::uint64_t with_one = list();
  for (int i = 0; i < kWorkers; ++i) {
    connect_other(fmt::format("w{}", i));
  }
  EXPECT_LT(list(), with_one + 5 * kWorkers) << "jobs × workers are " << kJobs * kWorkers;
}

TEST_F(WorkOfCalls, CheckingAHeldLeaseStopsAtItsFirstWrongTag) {
  const JobId job = submit(spec("r1", 4));
  const SessionId first = connect("w");
  HeldLease forged = held(got<LeaseGrant>(first).at(0));
  forged.unit.tiles.clear();
  for (std::uint32_t tile = 0; tile < 20'000; ++tile) {
    forged.unit.tiles.push_back(TileId{tile});
  }
  forged.tags.assign(forged.unit.tiles.size(), Sha256{});
  const std::uint64_t before = allocations;
  const SessionId second = connect("w", 1, "class-a", {forged});
  EXPECT_LT(allocations - before, 2'000u);
  ASSERT_FALSE(got<LeaseCancel>(second).empty());
  EXPECT_EQ(got<LeaseCancel>(second)[0].leases, std::vector<LeaseId>{forged.lease});
  work(second);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(WorkOfCalls, AHelloMayListAThousandLeasesAndEachTileOnce) {
  submit(spec("r1", 4));
  const SessionId first = connect("w");
  const HeldLease right = held(got<LeaseGrant>(first).at(0));
  std::vector<HeldLease> many(1'000, right);
  for (std::size_t i = 0; i < many.size(); ++i) {
    many[i].lease = LeaseId{i};
  }
  many.push_back(right);
  const auto cancelled = [&](std::vector<HeldLease> listed) {
    const SessionId session = connect("w", 1, "class-a", std::move(listed));
    std::set<LeaseId> leases;
    for (const LeaseCancel& each : got<LeaseCancel>(session)) {
      leases.insert(each.leases.begin(), each.leases.end());
    }
    return leases;
  };
  EXPECT_FALSE(cancelled({right, right}).contains(right.lease));
  EXPECT_TRUE(cancelled(many).contains(right.lease));
  HeldLease twice = right;
  twice.unit.tiles.push_back(right.unit.tiles.back());
  twice.tags.push_back(right.tags.back());
  EXPECT_TRUE(cancelled({twice}).contains(right.lease));
}

TEST_F(WorkOfCalls, ScenesOfAllJobsHaveALimit) {
  limits.scene_bytes = 100'000;
  restart({});
  const auto refusal = [&](const std::string& id, const std::string& owner, std::size_t bytes) {
    JobSpec job = spec(id);
    job.owner = owner;
    job.settings.scene = std::string(bytes, 's');
    return message_of(coordinator->submit(job, now, unix_ms(), effects).status());
  };
  EXPECT_EQ(refusal("a", "ada", 50'000), "");
  EXPECT_NE(refusal("b", "ada", 1).find("half of it for one user"), std::string::npos);
  EXPECT_EQ(refusal("b", "bob", 30'000), "");
  EXPECT_NE(refusal("c", "cleo", 30'000), "");
  ASSERT_TRUE(coordinator->cancel(JobId{1}, now, unix_ms(), effects).ok());
  EXPECT_NE(refusal("c", "cleo", 30'000), "") << "an ended job keeps its scene";
  flush();
  ASSERT_TRUE(coordinator->remove(JobId{1}, now, effects).ok());
  EXPECT_EQ(refusal("c", "cleo", 30'000), "");
}

}  // namespace
}  // namespace lightmill::test
