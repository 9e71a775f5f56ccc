// What clients ask of a coordinator.
#include "server/domain/coordinator_state.h"
#include "server/domain/job_rules.h"

namespace lightmill {

Result<JobId> Coordinator::submit(const JobSpec& spec, Time now, std::int64_t unix_ms, Step& step,
                                  const MethodNotes& notes) {
  state_->saw_clock(now, unix_ms, step);
  if (spec.request_id.empty()) {
    return invalid_argument("request_id must not be empty");
  }
  if (const auto found = state_->by_request.find(spec.request_id); found != state_->by_request.end()) {
    return found->second;
  }
  LM_RETURN_IF_ERROR(check_spec(spec, notes.candidates));
  if (state_->jobs.size() >= state_->limits.max_jobs) {
    return resource_exhausted("the farm keeps at most {} jobs: delete some that have ended", state_->limits.max_jobs);
  }
  const auto own = std::ranges::count_if(
      state_->jobs, [&](const auto& entry) { return entry.second->record.spec.owner == spec.owner; });
  if (own >= std::int64_t{state_->limits.max_jobs_per_owner}) {
    return resource_exhausted("the farm keeps at most {} jobs of one user, '{}': delete some that have ended",
                              state_->limits.max_jobs_per_owner, spec.owner);
  }
  LM_RETURN_IF_ERROR(state_->check_footprint(spec, nullptr));
  JobRecord record;
  record.id = JobId{state_->next_job_id++};
  record.spec = spec;
  record.method_notes = notes;
  record.submitted_unix_ms = unix_ms;
  const JobId id = record.id;
  auto made = std::make_unique<Job>(std::move(record), state_->limits.film_bytes_per_job, now);
  Job& job = *state_->jobs.emplace(id, std::move(made)).first->second;
  state_->by_request[spec.request_id] = id;
  state_->put_job(job, step);
  note(step, Note::Level::info, about(id), "job {} '{}' submitted by {}@{}: {}x{}, {}", id.value, spec.name, spec.owner,
       spec.host, spec.settings.crop.width, spec.settings.crop.height, describe(spec.goal));
  state_->queue_again(job);
  state_->serve_all(now, step);
  return id;
}

bool Coordinator::knows_request(const std::string& request_id) const {
  return state_->by_request.contains(request_id);
}

Status Coordinator::cancel(JobId id, Time now, std::int64_t unix_ms, Step& step) {
  state_->saw_clock(now, unix_ms, step);
  LM_ASSIGN_OR_RETURN(Job* const job, state_->ended_or_not(id, false, "cancelled"));
  state_->finish_job(*job, JobState::cancelled, "cancelled", now, step);
  state_->serve_all(now, step);
  return ok_status();
}

Status Coordinator::pause(JobId id, Time now, Step& step) {
  LM_ASSIGN_OR_RETURN(Job* const job, state_->ended_or_not(id, false, "paused"));
  if (job->record.state != JobState::paused) {
    // What is out is taken when it comes; nothing more goes out.
    job->record.state = JobState::paused;
    job->record.reason.clear();
    state_->put_job(*job, step);
    state_->refresh_queue(*job);
    note(step, Note::Level::info, about(id), "job {} is paused", id.value);
  }
  (void)now;
  return ok_status();
}

Status Coordinator::resume(JobId id, Time now, Step& step) {
  LM_ASSIGN_OR_RETURN(Job* const job, state_->ended_or_not(id, false, "resumed"));
  if (job->record.state != JobState::paused) {
    return failed_precondition("job {} cannot be resumed: it is {}", id.value, name_of(job->record.state));
  }
  job->record.state = job->record.fingerprint_class.empty() ? JobState::queued : JobState::running;
  job->record.reason.clear();
  state_->put_job(*job, step);
  state_->queue_again(*job);
  note(step, Note::Level::info, about(id), "job {} goes on", id.value);
  if (!state_->finish_if_complete(*job, now, step)) {
    state_->serve_all(now, step);
  }
  return ok_status();
}

Status Coordinator::extend(JobId id, const Extension& to, Time now, Step& step) {
  Job* const job = state_->find_job(id);
  if (job == nullptr) {
    return not_found("there is no job {}", id.value);
  }
  if (job->record.state == JobState::failed || job->record.state == JobState::cancelled) {
    return failed_precondition("job {} cannot be extended: it is {}", id.value, name_of(job->record.state));
  }
  JobSpec spec = job->record.spec;
  LM_ASSIGN_OR_RETURN(spec.goal, extended_goal(*job, to, now));
  LM_RETURN_IF_ERROR(state_->check_footprint(spec, job));
  job->record.spec.goal = spec.goal;
  if (spec.goal.seconds == 0) {
    state_->timed_jobs.erase(id);
  }
  if (job->active()) {
    job->plan->set_goal(job->samples_wanted_now());
    state_->put_job(*job, step);
    state_->refresh_queue(*job);
  } else {
    state_->reopen_done(*job, now);
    state_->put_job(*job, step);
  }
  note(step, Note::Level::info, about(id), "job {} is extended to {}", id.value, describe(spec.goal));
  if (!state_->finish_if_complete(*job, now, step)) {  // it may have the new error already
    state_->serve_all(now, step);
  }
  return ok_status();
}

Status Coordinator::set_priority(JobId id, std::int32_t priority, Time now, Step& step) {
  LM_ASSIGN_OR_RETURN(Job* const job, state_->ended_or_not(id, false, "given another priority"));
  if (job->record.spec.priority != priority) {
    job->record.spec.priority = priority;
    state_->put_job(*job, step);
    state_->queue_again(*job);
    note(step, Note::Level::info, about(id), "job {} has priority {} now", id.value, priority);
    state_->serve_all(now, step);
  }
  return ok_status();
}

void Coordinator::hold(const std::string& why, Time now, Step& step) {
  if (state_->held == why) {
    return;
  }
  if (state_->held.empty() != why.empty()) {
    note(step, why.empty() ? Note::Level::info : Note::Level::warning, Subject{}, "{}",
         why.empty() ? std::string("work is handed out again") : "no work is handed out: " + why);
  }
  state_->held = why;
  for (const auto& [id, job] : state_->jobs) {
    job->version += job->active() ? 1 : 0;
  }
  state_->serve_all(now, step);
}

const std::string& Coordinator::held() const {
  return state_->held;
}

Status Coordinator::remove(JobId id, Time now, Step& step) {
  LM_ASSIGN_OR_RETURN(Job* const job, state_->ended_or_not(id, true, "deleted before it is cancelled"));
  (void)now;
  state_->forget_job(*job, step);
  note(step, Note::Level::info, about(id), "job {} is deleted", id.value);
  return ok_status();
}

Status Coordinator::discard(JobId id, Time now, std::int64_t unix_ms, Step& step) {
  if (const Job* const job = state_->find_job(id); job != nullptr && job->active()) {
    LM_RETURN_IF_ERROR(cancel(id, now, unix_ms, step));
  }
  return remove(id, now, step);
}

}  // namespace lightmill
