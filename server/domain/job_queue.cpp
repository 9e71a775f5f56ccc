#include "server/domain/job_queue.h"

namespace lightmill {
namespace {

/// Time of the whole farm, in units, that a job's first picture gets before other jobs get their share.
constexpr double kFreshUnits = 2;
/// Shorter preparations are normal.
constexpr double kMinPreparationSeconds = 1;
/// First pictures of owners with more preparation time do not go before the work of others, in seconds.
constexpr double kMaxOwedOfFresh = 2;
/// An owner's preparation time is forgotten after this time without preparations.
constexpr Duration kDebtMemory = std::chrono::hours(1);

}  // namespace

void JobQueue::enter(const Job& job) {
  Share& share = shares_[job.id()] = {};
  share.at_start = queue_.starting_seconds(job.spec().priority);
  share.base = given_seconds(job) - share.at_start;
  active_[job.spec().owner].insert(job.id());
  refresh(job);
}

void JobQueue::add_lost(const Job& job, double seconds) {
  if (const auto share = shares_.find(job.id()); share != shares_.end()) {
    share->second.base -= seconds;
  }
}

void JobQueue::add_preparation(const Job& job, double seconds, Time now) {
  if (seconds < kMinPreparationSeconds) {
    return;
  }
  std::erase_if(debts_, [&](const auto& entry) { return now >= entry.second.last + kDebtMemory; });
  Debt& debt = debts_[job.spec().owner];
  debt.seconds += seconds;
  debt.last = now;
}

double JobQueue::owed_seconds(const Job& job) const {
  const auto debt = debts_.find(job.spec().owner);
  return debt == debts_.end() || job.cost().known() || owners() < 2 ? 0 : debt->second.seconds;
}

bool JobQueue::fell_behind(const Job& job, const FairQueue::Entry* other) {
  if (queue_.position(job.id()).owed_seconds == owed_seconds(job)) {
    return false;
  }
  refresh(job);
  return !queue_.contains(job.id()) ||
         (other != nullptr && *other < FairQueue::Entry{queue_.position(job.id()), job.id()});
}

void JobQueue::remove(const Job& job) {
  queue_.remove(job.id());
  shares_.erase(job.id());
  if (const auto active = active_.find(job.spec().owner); active != active_.end()) {
    active->second.erase(job.id());
    if (active->second.empty()) {
      active_.erase(active);
    }
  }
}

void JobQueue::refresh(const Job& job) {
  if (job.in_progress() && (job.plan().has_work() || job.audits().waiting())) {
    queue_.put(job.id(), {job.spec().priority, is_fresh(job), given_seconds(job), owed_seconds(job)});
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
  return job.plan().first_round() && given_seconds(job) - shares_.at(job.id()).at_start < head_start &&
         owed_seconds(job) < kMaxOwedOfFresh;
}

}  // namespace lightmill
