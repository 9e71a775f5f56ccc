// Fixture of a coordinator driven by hand, with workers on machines of their own. Some of them lie.
#pragma once

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {

class AuditTest : public CoordinatorTest {
 protected:
  /// A worker on a machine of its own, without authentication.
  SessionId connect_on(const std::string& machine, const std::string& name, std::uint32_t pid = 1,
                       const std::string& fingerprint = "class-a") {
    return connect_as({name, "host of " + machine, pid, 1, fingerprint, kRendererVersion, {}, false, machine});
  }
  /// A worker with the certificate of `identity`. Its name, machine and host are claims.
  SessionId connect_with(const std::string& identity, const std::string& name, const std::string& machine,
                         const std::string& host) {
    return connect_as(
        {identity + "/" + name, host, 1, 1, "class-a", kRendererVersion, {}, false, machine, false, identity});
  }
  SessionId connect_as(const WorkerHello& hello) {
    const SessionId session{next_session++};
    coordinator->worker_connected(session, hello, now, effects);
    flush();
    return session;
  }
  JobId submit_audited(double share = 1, const std::string& request = "r1", PixelRect crop = {0, 0, 64, 64}) {
    JobSpec job = spec(request, 1, crop);
    job.audit_share = share;
    return submit(job);
  }
  /// Answers every lease that the session has not answered, with bits that differ by `lie`.
  void answer(SessionId session, float lie = 0) {
    while (waiting(session) > 0) {
      answer_one(session, lie);
    }
  }
  /// Answers only the first of them, if there is one.
  void answer_one(SessionId session, float lie = 0) {
    if (waiting(session) == 0) {
      return;
    }
    const LeaseGrant grant = got<LeaseGrant>(session)[worked[session]++];
    for (const TileId tile : grant.unit.tiles) {
      WorkerResult sent_result = result(grant, tile);
      sent_result.node.values[0] += lie;
      sent_result.hash = hash_of(sent_result.node);
      say(session, sent_result);
    }
  }
  std::size_t waiting(SessionId session) const {
    const auto done = worked.find(session);
    return got<LeaseGrant>(session).size() - (done == worked.end() ? 0 : done->second);
  }
  /// Time passes while these workers send heartbeats.
  void pass_with(const std::vector<SessionId>& sessions, Duration time) {
    for (const Time until = now + time; now < until;) {
      pass(std::min<Duration>(limits.heartbeat_interval, until - now));
      for (const SessionId session : sessions) {
        say(session, WorkerHeartbeat{});
      }
    }
  }
  /// A store's state of this job. One of its results is stored and not yet audited.
  StoredState stored_with(JobId job, const WorkerResult& merged, const Renderer& by) const {
    StoredState stored{2, {}, job.value + 1};
    JobRecord record;
    for (const StoreOp& op : writes) {
      if (const auto* put = std::get_if<PutJob>(&op)) {
        record = put->record;
      }
    }
    stored.jobs.push_back({record, {{merged.key.tile, std::make_shared<const Node>(merged.node)}}});
    stored.jobs[0].results = {{merged.key.tile, merged.key.range, merged.hash, 0, true}};
    stored.renderers = {by};
    return stored;
  }
  template <class T>
  std::size_t written() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(writes, [](const StoreOp& op) { return std::holds_alternative<T>(op); }));
  }
  WorkerStatus worker(const std::string& name) const {
    for (const WorkerStatus& each : coordinator->workers(now)) {
      if (each.name == name) {
        return each;
      }
    }
    return {};
  }
};

}  // namespace lightmill::test
