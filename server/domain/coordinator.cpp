// The coordinator's parts, and the order in which they see each event.
#include "server/domain/coordinator.h"

#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "server/domain/copies.h"
#include "server/domain/farm_view.h"
#include "server/domain/result_intake.h"

namespace lightmill {

/// Each part knows only parts above it.
struct Coordinator::Parts {
  Parts(const CoordinatorLimits& the_limits, StoredState& stored, Time now)
      : limits(the_limits),
        epoch(stored.epoch),
        clock_time(now),
        signer(stored.secret),
        jobs(limits, stored.next_job_id),
        quarantined(std::move(stored.quarantine)),
        audits(limits, stored.secret, now, workers, quarantined, leases, provenance, totals) {}

  /// Event of a call that brings both times. Detects that the coordinator stood still.
  Event at(Time now, std::int64_t unix_ms, Effects& effects);
  Event at(Time now, Effects& effects) const { return {now, unix_ms(now), effects}; }
  std::int64_t unix_ms(Time now) const;
  std::optional<Time> next_deadline() const;
  Status serve_if(const Result<bool>& changed, const Event& event);
  void pilot_reported(SessionId session, Worker& worker, const PilotReport& report, const Event& event);
  void take_film(Job& job, StoredFilm film, const Event& event);

  const CoordinatorLimits limits;
  const std::uint64_t epoch;
  Time clock_time;  ///< of the last call that brought both times
  std::int64_t clock_unix_ms = 0;
  FarmTotals totals;

  const GrantSigner signer;
  JobTable jobs;
  Films films{limits, jobs};
  WorkerRegistry workers{limits};
  QuarantineList quarantined;
  Provenance provenance;
  JobQueue queue{limits, workers};
  LeaseTable leases{limits, epoch, signer, workers, jobs, queue, totals};
  Inspections inspections{workers, epoch << 32 | 1};  // ids that no other coordinator uses

  Audits audits;
  JobLifeCycle life_cycle{limits, jobs, films, leases, workers, queue, audits, provenance, totals};
  Pilots pilots{leases, jobs, queue, life_cycle};
  Scheduler scheduler{limits, clock_time, jobs, leases, workers, queue, life_cycle, pilots};
  Copies copies{limits, jobs, leases, workers, pilots, scheduler};
  Quarantine quarantine{quarantined, jobs, leases, workers, queue, provenance, life_cycle, scheduler, totals};
  Sessions sessions{limits, signer, jobs, leases, workers, quarantined, queue, life_cycle, scheduler, inspections};
  ResultIntake intake{signer,     jobs,      leases, workers,    quarantined, queue, provenance,
                      life_cycle, scheduler, audits, quarantine, sessions,    totals};
  FarmView view{limits, jobs, leases, workers, quarantined, audits, scheduler, totals};
};

Coordinator::Coordinator(const CoordinatorLimits& limits, StoredState state, Time now)
    : parts_(std::make_unique<Parts>(limits, state, now)) {
  LM_CHECK(state.epoch > 0 && state.epoch < std::uint64_t{1} << 32);
  for (StoredState::StoredJob& stored : state.jobs) {
    const std::vector<StoredState::StoredResult> results = std::move(stored.results);
    Job& job = parts_->jobs.restore(std::move(stored), now);
    parts_->audits.restore(job, state.renderers, results);
    parts_->life_cycle.restored(job, now);
  }
}
Coordinator::~Coordinator() = default;

// ---- time ----

std::int64_t Coordinator::Parts::unix_ms(Time now) const {
  return clock_unix_ms + std::chrono::duration_cast<std::chrono::milliseconds>(now - clock_time).count();
}

Event Coordinator::Parts::at(Time now, std::int64_t unix_ms, Effects& effects) {
  Event event{now, unix_ms, effects};
  const Duration late = now - std::max(next_deadline().value_or(now), clock_time);
  if (late > limits.lease_duration / 2) {
    // Stopped, suspended or out of memory: the messages of workers from this time are not read yet.
    event.warn({}, "the coordinator stood still for {:.0f} s: workers get their full time again", to_seconds(late));
    leases.extend_all(now);
    workers.note_stall(late, now);
    audits.note_stall(late);
    scheduler.note_stall(now);
  }
  clock_time = now;
  clock_unix_ms = unix_ms;
  return event;
}

void Coordinator::tick(Time now, std::int64_t unix_ms, Effects& effects) {
  const Event event = parts_->at(now, unix_ms, effects);
  parts_->workers.forget_absent(now);
  parts_->life_cycle.tick(event);
  parts_->films.tick(event);
  parts_->scheduler.serve_all(event);
  parts_->copies.tick(event);
  parts_->sessions.end_silent(event);
  parts_->inspections.tick(event);
  parts_->inspections.serve(event);
}

std::optional<Time> Coordinator::Parts::next_deadline() const {
  std::optional<Time> next;
  for (const std::optional<Time>& time :
       {leases.next_deadline(), life_cycle.next_deadline(), films.next_deadline(), copies.next_deadline(),
        workers.next_silence_check(), inspections.next_deadline()}) {
    next = next && time ? std::min(*next, *time) : next ? next : time;
  }
  return next;
}

std::optional<Time> Coordinator::next_deadline() const {
  return parts_->next_deadline();
}

void Coordinator::hold(const std::string& why, Time now, Effects& effects) {
  parts_->scheduler.hold(why, parts_->at(now, effects));
}

// ---- clients ----

Result<JobId> Coordinator::submit(const JobSpec& spec, Time now, std::int64_t unix_ms, Effects& effects,
                                  const MethodNotes& notes) {
  const Event event = parts_->at(now, unix_ms, effects);
  if (spec.request_id.empty()) {
    return invalid_argument("request_id must not be empty");
  }
  if (const std::optional<JobId> known = parts_->jobs.of_request(spec.request_id)) {
    return *known;
  }
  LM_ASSIGN_OR_RETURN(const JobId id, parts_->life_cycle.submit(spec, notes, event));
  parts_->films.make_room(0, now);
  parts_->scheduler.serve_all(event);
  return id;
}

bool Coordinator::knows_request(const std::string& request_id) const {
  return parts_->jobs.of_request(request_id).has_value();
}

Status Coordinator::cancel(JobId job, Time now, std::int64_t unix_ms, Effects& effects) {
  const Event event = parts_->at(now, unix_ms, effects);
  LM_RETURN_IF_ERROR(parts_->life_cycle.cancel(job, event));
  parts_->scheduler.serve_all(event);
  return ok_status();
}

Status Coordinator::pause(JobId job, Time now, Effects& effects) {
  return parts_->life_cycle.pause(job, parts_->at(now, effects));
}

Status Coordinator::Parts::serve_if(const Result<bool>& changed, const Event& event) {
  LM_RETURN_IF_ERROR(changed.status());
  if (*changed) {
    scheduler.serve_all(event);
  }
  return ok_status();
}

Status Coordinator::resume(JobId job, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  return parts_->serve_if(parts_->life_cycle.resume(job, event), event);
}

Status Coordinator::extend(JobId job, const Extension& to, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  const Result<bool> goes_on = parts_->life_cycle.extend(job, to, event);
  parts_->films.make_room(0, now);
  return parts_->serve_if(goes_on, event);
}

Status Coordinator::set_priority(JobId job, std::int32_t priority, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  return parts_->serve_if(parts_->life_cycle.set_priority(job, priority, event), event);
}

Status Coordinator::remove(JobId job, Time now, Effects& effects) {
  return parts_->life_cycle.remove(job, parts_->at(now, effects));
}

Status Coordinator::discard(JobId id, Time now, std::int64_t unix_ms, Effects& effects) {
  if (const Job* const job = parts_->jobs.find(id); job != nullptr && job->active()) {
    LM_RETURN_IF_ERROR(cancel(id, now, unix_ms, effects));
  }
  return remove(id, now, effects);
}

Status Coordinator::drain_worker(const std::string& name, Time now, Effects& effects) {
  return parts_->sessions.drain(name, parts_->at(now, effects));
}

Status Coordinator::quarantine_worker(const std::string& name, const std::string& reason, bool render_again, Time now,
                                      Effects& effects) {
  return parts_->quarantine.put(name, reason, render_again, parts_->at(now, effects));
}

Status Coordinator::release_worker(const std::string& name, Time now, Effects& effects) {
  return parts_->quarantine.release(name, parts_->at(now, effects));
}

void Coordinator::asset_is_missing(const Sha256& digest, Time now, Effects& effects) {
  parts_->view.asset_is_missing(digest, parts_->at(now, effects));
}

Result<InspectionId> Coordinator::inspect(const std::string& caller, InspectionRequest request, Time now,
                                          Effects& effects) {
  const Event event = parts_->at(now, effects);
  LM_ASSIGN_OR_RETURN(const InspectionId id, parts_->inspections.add(caller, std::move(request), now));
  parts_->inspections.serve(event);
  return id;
}

void Coordinator::forget_inspection(InspectionId id) {
  parts_->inspections.forget(id);
}

// ---- workers ----

void Coordinator::worker_connected(SessionId session, const WorkerHello& hello, Time now, Effects& effects) {
  parts_->sessions.connect(session, hello, parts_->at(now, parts_->unix_ms(now), effects));
}

void Coordinator::worker_message(SessionId session, WorkerMessage message, Time now, std::int64_t unix_ms,
                                 Effects& effects) {
  Parts& parts = *parts_;
  const Event event = parts.at(now, unix_ms, effects);
  if (parts.workers.find_session(session) == nullptr) {
    return;
  }
  Worker* const worker = parts.workers.of(session);
  auto* const result = std::get_if<WorkerResult>(&message);
  bool may_read_again = worker != nullptr && parts.workers.heard(*worker, result != nullptr, now);
  if (result != nullptr) {
    parts.intake.take(session, std::move(*result), event);
    return;
  }
  if (worker == nullptr) {
    return;
  }
  std::visit(Overloaded{
                 [&](const WorkerHeartbeat& heartbeat) { parts.sessions.heartbeat(*worker, heartbeat, event); },
                 [&](const WorkerReturn& lease) { parts.sessions.give_back(*worker, lease, event); },
                 [&](const PilotReport& report) { parts.pilot_reported(session, *worker, report, event); },
                 [&](const WorkerRefusal& refusal) { parts.sessions.refuse(*worker, refusal, event); },
                 [&](const InspectReport& report) {
                   parts.inspections.report(session, report, event);
                   may_read_again = true;
                 },
                 [&](const WorkerDraining&) {
                   parts.sessions.leaves(*worker, event);
                   may_read_again = true;
                 },
                 [](const auto&) {},  // a second hello has nothing new; results are handled above
             },
             message);
  if (may_read_again) {
    parts.inspections.serve(event);
  }
}

void Coordinator::Parts::pilot_reported(SessionId session, Worker& worker, const PilotReport& report,
                                        const Event& event) {
  const Result<bool> chosen = pilots.report(worker, report, event);
  if (!chosen.ok()) {
    sessions.distrust(session, report.lease, chosen.status(), event);
  } else if (*chosen) {
    scheduler.serve(worker, event);
    scheduler.serve_all(event);
  }
}

bool Coordinator::is_full(const std::string& worker) const {
  return parts_->workers.is_full(worker);
}

void Coordinator::evict_worker(SessionId session, Time now, Effects& effects) {
  Parts& parts = *parts_;
  const Event event = parts.at(now, effects);
  if (Worker* const worker = parts.workers.of(session)) {
    parts.sessions.leaves(*worker, event);
    for (const LeaseId lease : std::set(worker->leases())) {
      parts.sessions.give_back(*worker, {lease}, event);
    }
    parts.sessions.disconnected(session, event);
  }
}

void Coordinator::worker_disconnected(SessionId session, Time now, Effects& effects) {
  parts_->sessions.disconnected(session, parts_->at(now, effects));
}

void Coordinator::note_backlog(Time now) {
  parts_->workers.note_backlog(now);
}

void Coordinator::grants_sent(std::span<const LeaseId> leases, Time now) {
  parts_->leases.grants_sent(leases, now);
}

void Coordinator::ends_stored(std::span<const JobId> jobs) {
  for (const JobId id : jobs) {
    if (Job* const job = parts_->jobs.find(id)) {
      job->end_stored();
    }
  }
}

std::vector<JobId> ends_in(std::span<const StoreOp> writes) {
  std::vector<JobId> ended;
  for (const StoreOp& op : writes) {
    if (const auto* put = std::get_if<PutJob>(&op); put != nullptr && has_ended(put->record.state)) {
      ended.push_back(put->record.id);
    }
  }
  return ended;
}

std::vector<LeaseId> leases_granted(std::span<const Outgoing> messages) {
  std::vector<LeaseId> leases;
  for (const Outgoing& each : messages) {
    if (const auto* grant = std::get_if<LeaseGrant>(&each.message)) {
      leases.push_back(grant->lease);
    } else if (const auto* pilot = std::get_if<PilotGrant>(&each.message)) {
      leases.push_back(pilot->lease);
    }
  }
  return leases;
}

// ---- films ----

Result<bool> Coordinator::use_film(JobId id, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  LM_ASSIGN_OR_RETURN(Job* const job, parts_->jobs.get(id));
  const bool here = parts_->films.use(*job, now);
  if (!here) {
    parts_->films.serve(event);
  }
  return here;
}

void Coordinator::film_read(JobId id, Result<StoredFilm> film, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  Job* const job = parts_->jobs.find(id);
  if (job != nullptr && film.ok()) {
    parts_->take_film(*job, *std::move(film), event);
  } else if (job != nullptr) {
    event.warn(about(id), "the film of job {} cannot be read: {}", id.value, message_of(film.status()));
  }
  parts_->films.answered(id, job == nullptr ? not_found("there is no job {}", id.value) : film.status(), event);
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

// ---- queries ----

Result<JobStatus> Coordinator::status(JobId id, Time now) const {
  LM_ASSIGN_OR_RETURN(const Job* const job, parts_->jobs.get(id));
  return parts_->view.status(*job, now);
}

Result<JobStatus> Coordinator::decided_status(JobId id, Time now) const {
  LM_ASSIGN_OR_RETURN(const Job* const job, parts_->jobs.get(id));
  return parts_->view.decided_status(*job, now);
}

std::vector<JobStatus> Coordinator::jobs(Time now, const JobFilter& filter) const {
  return parts_->view.jobs(now, filter);
}

std::size_t Coordinator::count_jobs(const JobFilter& filter) const {
  return parts_->view.count_jobs(filter);
}

std::vector<WorkerStatus> Coordinator::workers(Time now, const WorkerFilter& filter) const {
  return parts_->view.workers(now, filter);
}

FarmLoad Coordinator::load() const {
  return parts_->view.load();
}

FarmGauges Coordinator::gauges() const {
  return parts_->view.gauges();
}

const FarmTotals& Coordinator::totals() const {
  return parts_->totals;
}

std::uint32_t Coordinator::wanted_workers(Time now) const {
  return parts_->view.wanted_workers(now);
}

bool Coordinator::wants_workers() const {
  return parts_->view.wants_workers();
}

const std::string& Coordinator::held() const {
  return parts_->scheduler.held();
}

Result<const JobSpec*> Coordinator::spec(JobId id) const {
  LM_ASSIGN_OR_RETURN(const Job* const job, parts_->jobs.get(id));
  return &job->spec();
}

Result<std::string> Coordinator::owner(JobId id) const {
  LM_ASSIGN_OR_RETURN(const Job* const job, parts_->jobs.get(id));
  return job->spec().owner;
}

std::set<Sha256> Coordinator::assets() const {
  std::set<Sha256> assets;
  for (const auto& [id, job] : parts_->jobs.all()) {
    const std::vector<Sha256>& named = job->spec().settings.assets;
    assets.insert(named.begin(), named.end());
  }
  return assets;
}

const FilmOutline* Coordinator::outline(JobId id) const {
  const Job* const job = parts_->jobs.find(id);
  return job == nullptr ? nullptr : &job->outline();
}

const Film* Coordinator::film(JobId id) const {
  const Job* const job = parts_->jobs.find(id);
  return job != nullptr && job->has_film() ? &job->film() : nullptr;
}

std::uint64_t Coordinator::version(JobId id) const {
  const Job* const job = parts_->jobs.find(id);
  return job == nullptr ? 0 : job->version();
}

std::vector<std::pair<JobId, std::uint64_t>> Coordinator::versions(std::size_t most) const {
  std::vector<std::pair<JobId, std::uint64_t>> found;
  const auto& jobs = parts_->jobs.all();
  for (auto at = jobs.rbegin(); at != jobs.rend() && found.size() < most; ++at) {
    found.emplace_back(at->first, at->second->version());
  }
  return found;
}

}  // namespace lightmill
