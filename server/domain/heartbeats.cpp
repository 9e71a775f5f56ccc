// What heartbeats tell: that workers live, and how long their results wait.
#include "common/base/quantities.h"
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// Who is silent is looked for so often at most, of all in one go, while `silence` passes: a look walks over everybody.
constexpr int kSilenceLooks = 20;
/// Of all workers together, if those who are there already had this interval too.
constexpr int kHeartbeatsPerSecond = 500;

}  // namespace

Duration Coordinator::State::heartbeat_interval() const {
  const Duration of_all = Duration(std::chrono::seconds(1)) * sessions.size() / kHeartbeatsPerSecond;
  return std::max(limits.heartbeat_interval,
                  std::min<Duration>({of_all, limits.lease_duration / 4, limits.silence / 4}));
}

void Coordinator::State::look_at_waits(Time now, Step& step) {
  if (!held.empty()) {
    pace.stood_still(now);
  }
  if (!pace.is_due(now)) {
    return;
  }
  std::vector<Duration> waits;
  for (const auto& [name, worker] : workers) {
    if (counts(worker) && worker.wait && worker.wait_at >= pace.heard_from(now)) {
      waits.push_back(*worker.wait);
    }
  }
  if (!pace.look(waits, now)) {
    return;
  }
  const double most = limits.result_bytes_per_second;
  if (!slowed && pace.bytes_per_second() < most / 2) {
    slowed = true;
    note(step, Note::Level::warning, Subject{},
         "workers' results wait long for the coordinator: they are sent more rarely, each of more samples");
  } else if (slowed && pace.bytes_per_second() == most) {
    slowed = false;
    note(step, Note::Level::info, Subject{}, "workers' results wait no longer: they are sent as often as before");
  }
}

void Coordinator::State::on_heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, Time now, Step& step) {
  if (heartbeat.longest_wait) {
    worker.wait = heartbeat.longest_wait;
    worker.wait_at = now;
  }
  look_at_waits(now, step);
  LeaseCancel unknown;
  for (const LeaseId id : heartbeat.leases) {
    const auto found = leases.find(id);
    if (found != leases.end() && found->second.worker == worker.hello.name) {
      renew(found->second, now);
    } else {
      unknown.leases.push_back(id);
    }
  }
  if (!unknown.leases.empty()) {
    send_after_commit(step, *worker.session, std::move(unknown));
  }
  serve(worker, now, step);
}

void Coordinator::State::hang_up_on_silent(Time now, Step& step) {
  next_silence_look = now + limits.silence;
  std::vector<SessionId> silent;
  for (const auto& [name, worker] : workers) {
    const Time silent_since = std::max(worker.heard_at, behind_at);
    if (worker.session && silent_since + limits.silence > now) {
      next_silence_look = std::min(next_silence_look, silent_since + limits.silence);
    } else if (worker.session) {
      note(step, Note::Level::warning, about(name), "worker {} is gone with {}: it has said nothing for {:.0f} s", name,
           counted(worker.leases.size(), "lease"), to_seconds(now - worker.heard_at));
      silent.push_back(*worker.session);
    }
  }
  next_silence_look = std::max(next_silence_look, now + limits.silence / kSilenceLooks);
  for (const SessionId session : silent) {
    end_session(session, now, step);
    step.hang_ups.push_back(session);
  }
  serve_inspections(now, step);  // by none of those that are silent, too
}

}  // namespace lightmill
