#include "server/domain/coordinator_parts.h"

namespace lightmill {

std::int64_t Coordinator::Parts::unix_ms(Time now) const {
  return clock_unix_ms + std::chrono::duration_cast<std::chrono::milliseconds>(now - clock_time).count();
}

Event Coordinator::Parts::at(Time now, std::int64_t unix_ms, Effects& effects) {
  Event event{now, unix_ms, effects};
  const Duration late = now - std::max(next_deadline().value_or(now), clock_time);
  if (late > limits.lease_duration / 2) {
    // Stopped, suspended or out of memory: the messages of workers from this time are not read yet.
    event.warn({}, "the coordinator was stopped for {:.0f} s. All leases are extended", to_seconds(late));
    leases.extend_all(late, now);
    workers.note_stall(late, now);
    audits.note_stall(late);
    scheduler.note_stall(now);
  }
  clock_time = now;
  clock_unix_ms = unix_ms;
  return event;
}

std::optional<Time> Coordinator::Parts::next_deadline() const {
  std::optional<Time> next;
  for (const std::optional<Time>& time :
       {leases.next_deadline(), life_cycle.next_deadline(), films.next_deadline(), copies.next_deadline(),
        preparations.next_deadline(), workers.next_silence_check(), inspections.next_deadline()}) {
    next = next && time ? std::min(*next, *time) : next ? next : time;
  }
  return next;
}

Status Coordinator::Parts::serve_if(const Result<bool>& changed, const Event& event) {
  LM_RETURN_IF_ERROR(changed.status());
  if (*changed) {
    scheduler.serve_all(event);
  }
  return ok_status();
}

void Coordinator::Parts::heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event) {
  sessions.heartbeat(worker, heartbeat, event);
  overruns.check(worker, heartbeat, event);
  scheduler.serve(worker, event);
}

void Coordinator::Parts::pilot_reported(SessionId session, Worker& worker, const PilotReport& report,
                                        const Event& event) {
  const Result<bool> chosen = pilots.report(worker, report, event);
  if (!chosen.ok()) {
    dismissals.distrust(session, report.lease, chosen.status(), event);
  } else if (*chosen) {
    scheduler.serve(worker, event);
    scheduler.serve_all(event);
  }
}

void Coordinator::Parts::take_film(Job& job, StoredFilm film, const Event& event) {
  const std::vector<NodeKey> missing = job.missing_from(film);
  for (const NodeKey& key : missing) {
    quarantine.drop_node(job, key.tile, key.range, event);
  }
  job.take_film(std::move(film));
  if (!missing.empty()) {
    event.warn(about(job.id()), "job {}: {} of its stored nodes {} damaged: {}", job.id().value, missing.size(),
               missing.size() == 1 ? "was" : "were",
               job.state() == JobState::done ? "they are rendered again" : "its picture lacks them");
  }
  life_cycle.film_loaded(job, missing.empty(), event);
  queue.refresh(job);
  scheduler.serve_all(event);
}

}  // namespace lightmill
