#include "client/cli/known_jobs.h"

namespace lightmill::cli {

bool KnownJobs::has(std::uint64_t id) const {
  const MutexLock lock(mutex_);
  return jobs_.contains(id);
}

Status KnownJobs::meet(const v1::Job& job) {
  const Identity identity{job.trace_id(), job.submitted_unix_ms()};
  const MutexLock lock(mutex_);
  if (jobs_.try_emplace(job.id(), identity).first->second == identity) {
    return ok_status();
  }
  return make_error(StatusCode::kAborted,
                    "job {} is not the same job as before: another farm answers at {} now, or the farm has lost its "
                    "data",
                    job.id(), address_);
}

Status KnownJobs::about(std::uint64_t id, const Status& answer) const {
  if (answer.code() != StatusCode::kNotFound || !has(id)) {
    return answer;
  }
  return make_error(StatusCode::kAborted,
                    "the farm at {} no longer has job {}: the job was deleted, the farm has lost its data, or another "
                    "farm answers there now",
                    address_, id);
}

}  // namespace lightmill::cli
