// Requests of clients that create and change jobs.
#include "common/farm/job_rules.h"
#include "server/domain/job_life_cycle.h"

namespace lightmill {

Result<Job*> JobLifeCycle::get(JobId id, bool ended, const char* what) {
  LM_ASSIGN_OR_RETURN(Job* const job, jobs_.get(id));
  if (job->active() == ended) {
    return failed_precondition("job {} cannot be {}: it is {}", id.value, what, name_of(job->state()));
  }
  return job;
}

Result<JobId> JobLifeCycle::submit(const JobSpec& spec, const MethodNotes& notes, const Event& event) {
  LM_RETURN_IF_ERROR(check_spec(spec, notes.candidates));
  LM_RETURN_IF_ERROR(jobs_.check_room(spec));
  LM_RETURN_IF_ERROR(jobs_.check_footprint(spec, nullptr));
  Job& job = jobs_.add(spec, notes, event);
  job.store(event);
  event.info(about(job.id()), "job {} '{}' submitted by {}@{}: {}x{}, {}", job.id().value, spec.name, spec.owner,
             spec.host, spec.settings.crop.width, spec.settings.crop.height, describe(spec.goal));
  queue_again(job);
  return job.id();
}

Status JobLifeCycle::cancel(JobId id, const Event& event) {
  LM_ASSIGN_OR_RETURN(Job* const job, get(id, false, "cancelled"));
  finish(*job, JobState::cancelled, "cancelled", event);
  return ok_status();
}

Status JobLifeCycle::pause(JobId id, const Event& event) {
  LM_ASSIGN_OR_RETURN(Job* const job, get(id, false, "paused"));
  if (job->state() != JobState::paused) {
    pause(*job, "", event);
    event.info(about(id), "job {} is paused", id.value);
  }
  return ok_status();
}

Result<bool> JobLifeCycle::resume(JobId id, const Event& event) {
  LM_ASSIGN_OR_RETURN(Job* const job, get(id, false, "resumed"));
  if (job->state() != JobState::paused) {
    return failed_precondition("job {} cannot be resumed: it is {}", id.value, name_of(job->state()));
  }
  job->resume();
  job->store(event);
  queue_again(*job);
  event.info(about(id), "job {} resumes", id.value);
  return !finish_if_complete(*job, event);
}

Result<bool> JobLifeCycle::extend(JobId id, const Extension& to, const Event& event) {
  LM_ASSIGN_OR_RETURN(Job* const job, jobs_.get(id));
  if (job->state() == JobState::failed || job->state() == JobState::cancelled) {
    return failed_precondition("job {} cannot be extended: it is {}", id.value, name_of(job->state()));
  }
  if (!job->has_film()) {
    return unavailable(
        "job {} cannot be extended: its film is still being read from the store. Try again in a few seconds", id.value);
  }
  JobSpec spec = job->spec();
  LM_ASSIGN_OR_RETURN(spec.goal, extended_goal(*job, to, event.now));
  LM_RETURN_IF_ERROR(jobs_.check_footprint(spec, job));
  job->extend(spec.goal);
  if (spec.goal.seconds == 0) {
    timed_.erase(id);
  }
  if (job->active()) {
    job->store(event);
    queue_.refresh(*job);
  } else {
    reopen(*job, event.now);
    job->store(event);
  }
  event.info(about(id), "job {} is extended to {}", id.value, describe(spec.goal));
  return !finish_if_complete(*job, event);  // it may have the new error already
}

Result<bool> JobLifeCycle::set_priority(JobId id, std::int32_t priority, const Event& event) {
  LM_ASSIGN_OR_RETURN(Job* const job, get(id, false, "given another priority"));
  if (job->spec().priority == priority) {
    return false;
  }
  job->set_priority(priority);
  job->store(event);
  queue_again(*job);
  event.info(about(id), "job {} has priority {} now", id.value, priority);
  return true;
}

Status JobLifeCycle::remove(JobId id, const Event& event) {
  LM_RETURN_IF_ERROR(get(id, true, "deleted before it is cancelled").status());
  forget(id, event);
  event.info(about(id), "job {} is deleted", id.value);
  return ok_status();
}

}  // namespace lightmill
