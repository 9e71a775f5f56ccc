// The order in which the coordinator's parts see each event.
#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "common/farm/job_rules.h"
#include "server/domain/coordinator_parts.h"

namespace lightmill {

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

void Coordinator::tick(Time now, std::int64_t unix_ms, Effects& effects) {
  const Event event = parts_->at(now, unix_ms, effects);
  parts_->workers.forget_absent(now);
  parts_->life_cycle.tick(event);
  parts_->films.tick(event);
  parts_->scheduler.serve_all(event);
  parts_->preparations.tick(event);
  parts_->copies.tick(event);
  parts_->sessions.end_silent(event);
  parts_->inspections.tick(event);
  parts_->inspections.serve(event);
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
  LM_RETURN_IF_ERROR(check_request_id(spec.request_id));
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

Status Coordinator::resume(JobId job, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  return parts_->serve_if(parts_->life_cycle.resume(job, event), event);
}

Status Coordinator::extend(JobId job, const Extension& to, Time now, Effects& effects) {
  const Event event = parts_->at(now, effects);
  const Result<bool> continues = parts_->life_cycle.extend(job, to, event);
  parts_->films.make_room(0, now);
  return parts_->serve_if(continues, event);
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
  parts_->waits.asset_is_missing(digest, parts_->at(now, effects));
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
  bool may_read_again = worker != nullptr && parts.workers.note_message(*worker, result != nullptr, now);
  if (result != nullptr) {
    parts.intake.take(session, std::move(*result), event);
    return;
  }
  if (worker == nullptr) {
    return;
  }
  std::visit(Overloaded{
                 [&](const WorkerHeartbeat& heartbeat) { parts.heartbeat(*worker, heartbeat, event); },
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
  Status status = job == nullptr ? not_found("there is no job {}", id.value) : film.status();
  if (job != nullptr && film.ok()) {
    parts_->take_film(*job, *std::move(film), event);
  } else if (job != nullptr) {
    event.warn(about(id), "the film of job {} cannot be read: table nodes: {}{}", id.value, message_of(status),
               status.code() == StatusCode::kDataLoss ? ". Restore a backup, or delete the job" : "");
    status = make_error(status.code(),
                        "the film of job {} cannot be read from the farm's store: ask the farm's administrator, who "
                        "finds the reason in the coordinator's log",
                        id.value);
  }
  parts_->films.answered(id, status, event);
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

FarmGauges Coordinator::gauges(Time now) const {
  return parts_->view.gauges(now);
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

std::set<Sha256> Coordinator::assets(const std::optional<Sha256>& of_jobs_with) const {
  std::set<Sha256> assets;
  for (const auto& [id, job] : parts_->jobs.all()) {
    const std::vector<Sha256>& named = *job->spec().settings.assets;
    if (!of_jobs_with || std::ranges::count(named, *of_jobs_with) > 0) {
      assets.insert(named.begin(), named.end());
    }
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
