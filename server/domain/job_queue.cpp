#include "server/domain/job_queue.h"

namespace lightmill {
namespace {

/// Time of the whole farm, in units, that a job's first picture gets before other jobs get their share.
constexpr double kFreshUnits = 2;

}  // namespace

void JobQueue::enter(const Job& job) {
  Share& share = shares_[job.id()] = {};
  share.at_start = queue_.starting_seconds(job.spec().priority);
  share.base = given_seconds(job) - share.at_start;
  refresh(job);
}

void JobQueue::add_lost(const Job& job, double seconds) {
  if (const auto share = shares_.find(job.id()); share != shares_.end()) {
    share->second.base -= seconds;
  }
}

void JobQueue::remove(JobId job) {
  queue_.remove(job);
  shares_.erase(job);
}

void JobQueue::refresh(const Job& job) {
  if (job.in_progress() && (job.plan().has_work() || job.audits().waiting())) {
    queue_.put(job.id(), {job.spec().priority, is_fresh(job), given_seconds(job)});
  } else {
    queue_.remove(job.id());
  }
}

double JobQueue::given_seconds(const Job& job) const {
  const auto out = static_cast<double>(job.plan().out_pixel_samples());
  return job.record().worker_seconds + out * job.cost().mean.value() - shares_.at(job.id()).base;
}

bool JobQueue::is_fresh(const Job& job) const {
  // Bounded, because the first picture of a huge film must not delay other jobs for long.
  const double head_start =
      kFreshUnits * limits_.unit_seconds * static_cast<double>(std::max<std::uint64_t>(workers_.threads(), 1));
  return job.plan().first_round() && given_seconds(job) - shares_.at(job.id()).at_start < head_start;
}

}  // namespace lightmill
