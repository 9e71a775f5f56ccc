#include "server/domain/job_table.h"

#include "common/base/number_text.h"

namespace lightmill {
namespace {

std::uint64_t scene_bytes(const JobSpec& spec) {
  return spec.settings.scene->size() + spec.settings.assets->size() * sizeof(Sha256);
}

}  // namespace

Job* JobTable::find(JobId id) const {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second.get();
}

Result<Job*> JobTable::get(JobId id) const {
  if (Job* const job = find(id)) {
    return job;
  }
  return not_found("there is no job {}", id.value);
}

std::optional<JobId> JobTable::of_request(const std::string& request_id) const {
  const auto found = by_request_.find(request_id);
  return found == by_request_.end() ? std::nullopt : std::optional(found->second);
}

Job& JobTable::add(const JobSpec& spec, const MethodNotes& notes, const Event& event) {
  JobRecord record;
  record.id = JobId{next_id_++};
  record.spec = spec;
  record.method_notes = notes;
  record.submitted_unix_ms = event.unix_ms;
  by_request_[spec.request_id] = record.id;
  const JobId id = record.id;
  return *jobs_.emplace(id, std::make_unique<Job>(std::move(record), limits_, event.now)).first->second;
}

Job& JobTable::restore(StoredState::StoredJob stored, Time now) {
  const JobId id = stored.record.id;
  by_request_[stored.record.spec.request_id] = id;
  Job& job = *jobs_.emplace(id, std::make_unique<Job>(std::move(stored.record), limits_, now)).first->second;
  job.restore(std::move(stored.nodes), now);
  return job;
}

void JobTable::remove(JobId id, const Event& event) {
  const JobSpec& spec = at(id).spec();
  by_request_.erase(spec.request_id);
  event.store(DeleteJobRows{id, spec.name});
  jobs_.erase(id);
}

Status JobTable::check_room(const JobSpec& spec) const {
  const std::string& owner = spec.owner;
  if (jobs_.size() >= limits_.max_jobs) {
    return resource_exhausted("the farm keeps at most {} jobs: delete some that have ended", limits_.max_jobs);
  }
  const auto own = std::ranges::count_if(jobs_, [&](const auto& entry) { return entry.second->spec().owner == owner; });
  if (own >= std::int64_t{limits_.max_jobs_per_owner}) {
    return resource_exhausted("the farm keeps at most {} jobs of one user, '{}': delete some that have ended",
                              limits_.max_jobs_per_owner, owner);
  }
  std::uint64_t all_bytes = scene_bytes(spec), own_bytes = all_bytes;
  for (const auto& [id, job] : jobs_) {
    const std::uint64_t bytes = scene_bytes(job->spec());
    all_bytes += bytes;
    own_bytes += job->spec().owner == owner ? bytes : 0;
  }
  if (all_bytes > limits_.scene_bytes || own_bytes > limits_.scene_bytes / 2) {
    return resource_exhausted(
        "the scenes of all jobs would need {:.4g} GiB, those of '{}' {:.4g} GiB: the farm keeps at most {:.4g} GiB, "
        "and half of it for one user. Delete some jobs that have ended",
        gib(all_bytes), owner, gib(own_bytes), gib(limits_.scene_bytes));
  }
  return ok_status();
}

Status JobTable::check_footprint(const JobSpec& spec, const Job* instead_of) const {
  const std::uint64_t own = finished_bytes(spec);
  if (own > limits_.film_bytes) {
    return invalid_argument(
        "the film may need {:.4g} GiB, more than the coordinator's limit of {:.4g} GiB (--films-gib): choose a smaller "
        "--size, or fewer layers",
        gib(own), gib(limits_.film_bytes));
  }
  std::uint64_t active = own, largest_ended = 0, of_owner = own;
  for (const auto& [id, job] : jobs_) {
    if (job.get() == instead_of) {
      continue;
    }
    const std::uint64_t bytes = job->active() ? job->reserved_bytes() : job->outline().bytes();
    if (job->active()) {
      active += bytes;
    } else {
      largest_ended = std::max(largest_ended, bytes);
    }
    of_owner += job->spec().owner == spec.owner ? bytes : 0;
  }
  if (of_owner > limits_.film_bytes_per_owner) {
    return resource_exhausted(
        "the films of '{}' may need {:.4g} GiB of disk, more than the coordinator's limit of {:.4g} GiB (--user-disk-gib). "
        "Delete some jobs that have ended",
        spec.owner, gib(of_owner), gib(limits_.film_bytes_per_owner));
  }
  if (active + largest_ended > limits_.film_bytes) {
    return resource_exhausted(
        "the films of all jobs that have not ended may need {:.4g} GiB, and the largest film of an ended job {:.4g} "
        "GiB. This is more than the coordinator's limit of {:.4g} GiB (--films-gib). Try again when a job has ended",
        gib(active), gib(largest_ended), gib(limits_.film_bytes));
  }
  return ok_status();
}

}  // namespace lightmill
