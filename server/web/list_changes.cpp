#include "server/web/list_changes.h"

namespace lightmill {
namespace {

/// Rates, times and wait reasons change without an event of the job.
constexpr Duration kReviewInterval = std::chrono::seconds(2);

}  // namespace

ListChanges ListTracker::poll(const Coordinator& farm, Time now, std::span<const JobId> ended) {
  ListChanges changes;
  const bool review = now >= next_review_;
  next_review_ = review ? now + kReviewInterval : next_review_;
  std::map<JobId, Known> listed;
  for (const auto& [job, version] : farm.versions(kMaxJobs)) {
    const auto before = known_.find(job);
    Known known = before == known_.end() ? Known{} : before->second;
    if (known.version != version || (known.active && review)) {
      JobStatus status = farm.status(job, now).value();
      known = {version, !has_ended(status.state)};
      changes.jobs.push_back(std::move(status));
    }
    listed.emplace(job, known);
  }
  for (const auto& [job, known] : known_) {
    if (!listed.contains(job)) {
      changes.removed.push_back(job);
    }
  }
  known_ = std::move(listed);
  changes.workers = farm.workers(now);
  for (const JobId job : ended) {
    if (const Result<JobStatus> status = farm.status(job, now); status.ok() && !has_ended(status->state)) {
      changes.revived.push_back(job);
    }
  }
  return changes;
}

}  // namespace lightmill
