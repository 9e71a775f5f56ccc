// Workers that refuse jobs: which ones count, and which worker is asked next.
#include "tests/unit/server/audit_fixture.h"

namespace lightmill::test {
namespace {

class RefusalTest : public AuditTest {
 protected:
  /// A job without audits. A worker that refused a job does not audit it, so tests would wait.
  JobId submit_unaudited(const std::string& request, std::uint64_t samples) {
    JobSpec job = spec(request, samples);
    job.audit_share = 0;
    return submit(job);
  }
  std::string reason(JobId job) const { return status(job).reason; }
  /// A job whose method a pilot picks.
  JobId submit_undecided() {
    JobSpec job = spec("r1", 64);
    job.settings.method = "auto";
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), effects, {true, {"two do"}, {}, {"path", "ao"}});
    EXPECT_TRUE(id.ok()) << id.status();
    flush();
    return *id;
  }
};

TEST_F(RefusalTest, OneIdentityCannotFailAJobThatAnotherMayRender) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId liar = connect_on("m1", "liar"), honest = connect_on("m2", "honest");
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(status(job).state, JobState::running);
  const std::size_t grants = got<LeaseGrant>(liar).size();
  work(honest);
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
  EXPECT_EQ(got<LeaseGrant>(liar).size(), grants) << "not even copies";
  EXPECT_EQ(status(job).counters.leases_lost, 0u);
  submit(spec("r2", 64));
  EXPECT_GT(got<LeaseGrant>(liar).size(), grants) << "it gets other jobs";
}

TEST_F(RefusalTest, TwoIdentitiesFailTheJobWithBothReasons) {
  const JobId job = submit(spec());
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  say(a, WorkerRefusal{job, "mesh 'floor' is empty\nand more"});
  say(b, WorkerRefusal{job, "mesh 'wall' is empty"});
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(reason(job).find('\n'), std::string::npos);
  EXPECT_TRUE(reason(job).starts_with("worker a: mesh 'floor' is empty")) << reason(job);
  EXPECT_TRUE(reason(job).ends_with("; worker b: mesh 'wall' is empty")) << reason(job);
}

TEST_F(RefusalTest, TwoIdentitiesCannotFailAJobThatAThirdRenders) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId honest = connect_on("m3", "honest");
  answer_one(honest);
  ASSERT_GT(status(job).samples_done, 0u);
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  say(a, WorkerRefusal{job, "a library is broken"});
  say(b, WorkerRefusal{job, "a library is broken"});
  EXPECT_EQ(status(job).state, JobState::running) << reason(job);
  work(honest);
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
}

TEST_F(RefusalTest, TwoIdentitiesFailAJobWhenTheThirdHasLeft) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId third = connect_on("m3", "third");
  answer_one(third);
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  say(a, WorkerRefusal{job, "asset 7 is damaged"});
  say(b, WorkerRefusal{job, "asset 7 is damaged"});
  EXPECT_EQ(status(job).state, JobState::running);
  coordinator->worker_disconnected(third, now, effects);
  pass_with({a, b}, limits.disconnect_grace + limits.auditor_timeout);
  EXPECT_EQ(status(job).state, JobState::failed);
}

TEST_F(RefusalTest, ASharedReasonIsListedOnce) {
  const JobId job = submit(spec());
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  say(a, WorkerRefusal{job, "mesh 'floor' is empty"});
  say(b, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(reason(job), "workers a and b: mesh 'floor' is empty");
}

TEST_F(RefusalTest, WorkersOfOneIdentityCountOnce) {
  const JobId job = submit(spec("r1", 64, {0, 0, 512, 64}));
  const SessionId a1 = connect_on("m1", "a1"), a2 = connect_on("m1", "a2");
  const SessionId honest = connect_on("m2", "honest");
  ASSERT_EQ(got<LeaseCancel>(a2).size(), 0u);
  say(a1, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(got<LeaseCancel>(a2).size(), got<LeaseGrant>(a2).size()) << "it would refuse too";
  say(a2, WorkerRefusal{job, "mesh 'wall' is empty"});
  EXPECT_EQ(status(job).state, JobState::running);
  // Another name or process does not help, either.
  coordinator->worker_disconnected(a1, now, effects);
  const SessionId a3 = connect_on("m1", "a3", 7);
  EXPECT_TRUE(got<LeaseGrant>(a3).empty());
  work(honest);
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
}

TEST_F(RefusalTest, AJobWaitsForAnotherIdentityWithAReason) {
  const JobId first = submit_unaudited("r0", 64);
  const SessionId honest = connect_on("m2", "honest");  // has work of the first job
  const SessionId liar = connect_on("m1", "liar");
  const JobId job = submit_unaudited("r1", 64);
  while (status(job).state == JobState::queued) {
    answer_one(liar);
  }
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(reason(job), "waits for a worker of another identity: worker liar refused it: mesh 'floor' is empty");
  for (int i = 0; i < 1000 && status(job).state != JobState::done; ++i) {
    answer_one(honest);
    answer_one(liar);
  }
  EXPECT_EQ(status(first).state, JobState::done);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(reason(job).find("refused"), std::string::npos);
}

TEST_F(RefusalTest, AJobFailsWhenNoOtherIdentityIsExpected) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId other = connect_on("m2", "other");
  coordinator->worker_disconnected(other, now, effects);
  pass(limits.disconnect_grace);
  const SessionId a = connect_on("m1", "a");
  ASSERT_FALSE(got<LeaseGrant>(a).empty());
  say(a, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_NE(status(job).state, JobState::failed) << "the other one may be restarting";
  EXPECT_EQ(reason(job), "waits for a worker of another identity: worker a refused it: mesh 'floor' is empty");
  pass_with({a}, limits.auditor_timeout);
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(reason(job), "worker a: mesh 'floor' is empty");
}

TEST_F(RefusalTest, ADepartedWorkerIsNotWaitedFor) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId a = connect_on("m1", "a"), other = connect_on("m2", "other");
  say(a, WorkerRefusal{job, "mesh 'floor' is empty"});
  say(other, WorkerDraining{});
  for (const LeaseGrant& grant : got<LeaseGrant>(other)) {
    say(other, WorkerReturn{grant.lease});
  }
  pass(std::chrono::seconds(1));
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(reason(job), "worker a: mesh 'floor' is empty");
}

TEST_F(RefusalTest, AJobWithSamplesOfAnotherIdentityDoesNotFailWhenItLeaves) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId liar = connect_on("m1", "liar"), honest = connect_on("m2", "honest");
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  answer_one(honest);
  coordinator->worker_disconnected(honest, now, effects);
  pass_with({liar}, limits.auditor_timeout + limits.lease_duration);
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(reason(job), "waits for a worker of another identity: worker liar refused it: mesh 'floor' is empty");
  work(connect_on("m3", "third"));
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(RefusalTest, ATooSmallWorkerDoesNotCountAsAnotherRenderer) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId a = connect_on("m1", "a"), small = connect_on("m2", "small");
  say(small, WorkerRefusal{job, "too large", true});
  say(a, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(reason(job), "worker a: mesh 'floor' is empty");
}

TEST_F(RefusalTest, TheJobFailsWhenTheLastOtherWorkerIsTooSmall) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId a = connect_on("m1", "a"), small = connect_on("m2", "small");
  say(a, WorkerRefusal{job, "mesh 'floor' is empty"});
  say(small, WorkerRefusal{job, "too large", true});
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(reason(job), "worker a: mesh 'floor' is empty");
}

TEST_F(RefusalTest, AnotherClassIsAskedBeforeTheFirstSample) {
  const JobId job = submit(spec());
  const SessionId liar = connect_on("m1", "liar"), other = connect_on("m2", "other", 1, "class-b");
  EXPECT_TRUE(got<LeaseGrant>(other).empty());
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(status(job).fingerprint_class, "class-b");
  work(other);
  EXPECT_EQ(status(job).state, JobState::done);
}

TEST_F(RefusalTest, AnotherClassIsAskedForAPausedJobBeforeTheFirstSample) {
  const JobId job = submit_unaudited("r1", 64);
  const SessionId a = connect_on("m1", "a", 1, "class-a");
  const SessionId b = connect_on("m2", "b", 1, "class-b");
  ASSERT_EQ(status(job).fingerprint_class, "class-a");
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  flush();
  say(a, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(status(job).state, JobState::paused) << reason(job);
  ASSERT_TRUE(coordinator->resume(job, now, effects).ok());
  flush();
  work(b);
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
  EXPECT_EQ(status(job).fingerprint_class, "class-b");
}

TEST_F(RefusalTest, RefusalsOfAPilotCountForTheJob) {
  const SessionId liar = connect_on("m1", "a liar"), honest = connect_on("m2", "honest");
  const JobId job = submit_undecided();
  ASSERT_EQ(got<PilotGrant>(liar).size(), 1u);
  say(liar, WorkerRefusal{job, "an asset is damaged"});
  EXPECT_NE(status(job).state, JobState::failed);
  ASSERT_FALSE(got<PilotGrant>(honest).empty());
  say(honest, PilotReport{got<PilotGrant>(honest).back().lease, 0, {}, 0.1});
  // A pilot's report shows that the job can be rendered. So the job does not fail when that worker leaves.
  coordinator->worker_disconnected(honest, now, effects);
  pass_with({liar}, limits.auditor_timeout + limits.lease_duration);
  EXPECT_EQ(status(job).state, JobState::running) << reason(job);
  work(connect_on("m2", "honest"));
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
  EXPECT_TRUE(got<LeaseGrant>(liar).empty());
}

TEST_F(RefusalTest, TwoIdentitiesThatRefuseThePilotFailTheJob) {
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  const JobId job = submit_undecided();
  const bool a_first = !got<PilotGrant>(a).empty();
  say(a_first ? a : b, WorkerRefusal{job, "an asset is damaged"});
  say(a_first ? b : a, WorkerRefusal{job, "an asset is damaged"});
  EXPECT_EQ(status(job).state, JobState::failed);
  EXPECT_EQ(reason(job), fmt::format("workers {}: an asset is damaged", a_first ? "a and b" : "b and a"));
}

TEST_F(RefusalTest, ARestartedCoordinatorWaitsForKnownIdentities) {
  // Two identities rendered an earlier job. The liar returns first.
  const SessionId a = connect_on("m1", "a"), b = connect_on("m2", "b");
  const JobId before = submit_audited(1, "r0", {0, 0, 512, 64});
  const LeaseGrant of_a = got<LeaseGrant>(a).at(0), of_b = got<LeaseGrant>(b).at(0);
  const WorkerResult from_a = result(of_a, of_a.unit.tiles[0]), from_b = result(of_b, of_b.unit.tiles[0]);
  StoredState stored = stored_with(before, from_a, {"a", "m1", ""});
  stored.jobs[0].nodes.push_back({from_b.key.tile, std::make_shared<const Node>(from_b.node)});
  stored.jobs[0].results.push_back({from_b.key.tile, from_b.key.range, from_b.hash, 1, true});
  stored.renderers.push_back({"b", "m2", ""});
  restart(std::move(stored));
  const SessionId liar = connect_on("m1", "a");
  const JobId job = submit_unaudited("r1", 64);
  pass_with({liar}, limits.restart_grace / 2);
  ASSERT_FALSE(got<LeaseGrant>(liar).empty());
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  pass(std::chrono::milliseconds(500));
  EXPECT_NE(status(job).state, JobState::failed) << reason(job);
  work(connect_on("m2", "b"));
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
}

TEST_F(RefusalTest, AStoredJobDoesNotFailBeforeOthersCanReconnect) {
  const JobId job = submit(spec("r1", 64));
  StoredState stored{2, {}, job.value + 1};
  for (const StoreOp& op : writes) {
    if (const auto* put = std::get_if<PutJob>(&op)) {
      stored.jobs.push_back({put->record, {}});
    }
  }
  ASSERT_EQ(stored.jobs.size(), 1u);
  restart(std::move(stored));
  const SessionId liar = connect_on("m1", "liar");
  ASSERT_FALSE(got<LeaseGrant>(liar).empty());
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  pass(limits.restart_grace / 2);
  EXPECT_NE(status(job).state, JobState::failed);
  pass(limits.restart_grace);
  EXPECT_EQ(status(job).state, JobState::failed) << "it is alone";
}

TEST_F(RefusalTest, AClassIsReplacedWhenItsOtherWorkerStaysAway) {
  const SessionId liar = connect_on("m1", "liar"), away = connect_on("m2", "away");
  const JobId job = submit(spec("r1", 64, {0, 0, 512, 64}));
  ASSERT_FALSE(got<LeaseGrant>(away).empty());
  coordinator->worker_disconnected(away, now, effects);
  flush();
  const SessionId other = connect_on("m3", "other", 1, "class-b");
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_TRUE(got<LeaseGrant>(other).empty()) << "its lease is still out";
  pass_with({liar, other}, limits.lease_duration);
  EXPECT_EQ(status(job).fingerprint_class, "class-b");
  work(other);
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
}

TEST_F(RefusalTest, ALeavingWorkerMayFinishARefusedJob) {
  const SessionId liar = connect_on("m1", "liar"), leaving = connect_on("m2", "leaving");
  const JobId job = submit(spec("r1", 1, {0, 0, 512, 64}));
  const LeaseGrant grant = got<LeaseGrant>(leaving).at(0);
  say(leaving, WorkerDraining{});
  say(liar, WorkerRefusal{job, "mesh 'floor' is empty"});
  EXPECT_EQ(status(job).state, JobState::running);
  finish(leaving, grant);
  EXPECT_EQ(status(job).state, JobState::running) << "it can be rendered";
  EXPECT_GT(status(job).samples_done, 0u);
}

TEST_F(RefusalTest, AReconnectingTooSmallWorkerIsAskedRarely) {
  const JobId job = submit_unaudited("r1", 4);
  std::uint32_t asked = 0;
  for (std::uint32_t i = 0; i < 600; ++i) {
    const SessionId small = connect_on("m1", "small " + std::to_string(i), i);
    pass_with({small}, std::chrono::milliseconds(100));
    if (!got<LeaseGrant>(small).empty()) {
      ++asked;
      say(small, WorkerRefusal{job, "too large", true});
    }
    coordinator->worker_disconnected(small, now, effects);
    flush();
  }
  // In a minute: twice at once, then after 0.5, 1, 2, 4, 8, 16 and 32 s.
  EXPECT_GE(asked, 2u);
  EXPECT_LE(asked, 9u);
  work(connect_on("m2", "large"));
  EXPECT_EQ(status(job).state, JobState::done) << reason(job);
}

}  // namespace
}  // namespace lightmill::test
