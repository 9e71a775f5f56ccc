#include "server/domain/job_queue.h"

namespace lightmill {
namespace {

/// Time of the whole farm, in units, that a job's first picture gets before other jobs get their share.
constexpr double kFreshUnits = 2;

}  // namespace

void JobQueue::enter(Job& job) {
  job.share.base = 0;
  job.share.at_start = queue_.starting_seconds(job.record.spec.priority);
  job.share.base = given_seconds(job) - job.share.at_start;
  refresh(job);
}

void JobQueue::refresh(Job& job) {
  if (job.in_progress() && (job.plan->has_work() || job.audits.waiting())) {
    queue_.put(job.id(), {job.record.spec.priority, is_fresh(job), given_seconds(job)});
  } else {
    queue_.remove(job.id());
  }
}

double JobQueue::given_seconds(const Job& job) {
  const double out = job.plan ? static_cast<double>(job.plan->out_pixel_samples()) : 0;
  return job.record.worker_seconds + out * job.cost.mean.value() - job.share.base;
}

bool JobQueue::is_fresh(const Job& job) const {
  // Bounded, because the first picture of a huge film must not delay other jobs for long.
  const double head_start =
      kFreshUnits * limits_.unit_seconds * static_cast<double>(std::max<std::uint64_t>(workers_.threads(), 1));
  return job.plan->first_round() && given_seconds(job) - job.share.at_start < head_start;
}

}  // namespace lightmill
