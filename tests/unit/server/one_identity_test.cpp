// What one worker identity cannot do to a job, under any names and in any number of processes.
#include "server/domain/pending_audits.h"
#include "tests/unit/server/verifying_fixture.h"

namespace lightmill::test {
namespace {

class OneIdentityTest : public VerifyingTest {
 protected:
  /// A worker with the certificate of `identity`.
  SessionId join(const std::string& identity, const std::string& name, std::uint32_t pid = 1, std::uint32_t threads = 1,
                 std::vector<HeldLease> held = {}) {
    return connect_as(
        {name, "host", pid, threads, "class-a", kRendererVersion, std::move(held), false, "machine", false, identity});
  }
  /// Streams of a worker break, and each time another process comes under its name. Returns the session of the last one.
  SessionId restart_worker(SessionId session, const std::string& identity, const std::string& name, int times) {
    for (int i = 0; i < times; ++i) {
      coordinator->worker_disconnected(session, now, effects);
      flush();
      now += std::chrono::milliseconds(10);
      session = join(identity, name, ++last_pid);
    }
    return session;
  }
  std::uint32_t last_pid = 1;
};

TEST_F(OneIdentityTest, CannotLoseAnAuditForEver) {
  const JobId job = submit_verified();
  const SessionId liar = join("liar", "a"), honest = join("honest", "c");
  answer(liar, 1);
  // Without a third identity the audit would be over.
  coordinator->worker_disconnected(honest, now, effects);
  pass(limits.disconnect_grace + std::chrono::seconds(1));
  const SessionId accomplice = restart_worker(join("friend", "!"), "friend", "!", 20);
  EXPECT_EQ(status(job).state, JobState::running) << status(job).reason;
  const SessionId back = join("honest", "c");
  ASSERT_EQ(waiting(back), 1u);
  answer(back);
  const SessionId third = join("third", "d");
  answer(third);
  EXPECT_NE(worker("a").quarantine, "");
  for (int i = 0; i < 2; ++i) {
    for (const SessionId session : {accomplice, back, third}) {
      answer(session);
    }
  }
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(coordinator->film(job)->sums(TileId{0})[0], 1.0f);
}

TEST_F(OneIdentityTest, ThatLosesTheOnlyAuditLeavesTheResultUnaudited) {
  const JobId job = submit_verified();
  const SessionId first = join("first", "a"), second = join("second", "b");
  answer(first);
  const SessionId last = restart_worker(second, "second", "b", static_cast<int>(PendingAudits::kMostLost) - 1);
  EXPECT_EQ(status(job).state, JobState::running);
  restart_worker(last, "second", "b", 1);
  EXPECT_EQ(status(job).state, JobState::done) << "there is no other identity";
  EXPECT_EQ(status(job).results_unverified, 1u);
  EXPECT_EQ(status(job).audits_lost, 1u);
}

}  // namespace
}  // namespace lightmill::test
