// Fixture of a coordinator driven by hand, with a job whose method a pilot picks.
#pragma once

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {

class PilotTest : public CoordinatorTest {
 protected:
  JobId submit_undecided(const std::string& request_id = "r1") { return submit_undecided(spec(request_id)); }
  JobId submit_undecided(JobSpec job) {
    job.settings.method = "auto";
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), effects, {true, {"two do"}, {}, {"path", "ao"}});
    EXPECT_TRUE(id.ok()) << id.status();
    flush();
    return *id;
  }
  PilotGrant pilot(SessionId session) const {
    const std::vector<PilotGrant> grants = got<PilotGrant>(session);
    EXPECT_FALSE(grants.empty());
    return grants.empty() ? PilotGrant{} : grants.back();
  }
  void report(SessionId session, std::uint32_t choice) {
    say(session, PilotReport{pilot(session).lease, choice, {"it is cheaper"}, 0.5});
  }
  /// Time passes while these workers send heartbeats.
  void live(Duration time, std::initializer_list<SessionId> sessions) {
    constexpr Duration kStep = std::chrono::milliseconds(100);
    for (Duration done{}; done < time; done += kStep) {
      pass(kStep);
      for (const SessionId session : sessions) {
        std::vector<LeaseId> held;
        for (const PilotGrant& grant : got<PilotGrant>(session)) {
          held.push_back(grant.lease);
        }
        say(session, WorkerHeartbeat{held});
      }
    }
  }
  /// The job's last row.
  JobRecord stored() const {
    for (auto at = writes.rbegin(); at != writes.rend(); ++at) {
      if (const auto* put = std::get_if<PutJob>(&*at)) {
        return put->record;
      }
    }
    return {};
  }
};

}  // namespace lightmill::test
