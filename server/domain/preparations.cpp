#include "server/domain/preparations.h"

#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

constexpr Duration kSearchInterval = std::chrono::seconds(1);
/// Time of a preparation before it can be preempted. Each preemption doubles it for that job, up to kMaxDoublings
/// times. So a scene that takes long is prepared in the end.
constexpr Duration kPreparationTimeout = std::chrono::seconds(10);
constexpr std::uint32_t kMaxDoublings = 6;
/// Jobs for which one search finds a worker.
constexpr std::size_t kMaxHeldUp = 32;

}  // namespace

std::optional<Time> Preparations::next_deadline() const {
  const bool possible = scheduler_.held().empty() && queue_.owners() > 1 && !leases_.all().empty();
  return possible ? std::optional(next_check_) : std::nullopt;
}

const Lease* Preparations::at_work(const Worker& worker) const {
  for (const LeaseId id : worker.leases()) {
    if (const Lease& lease = leases_.at(id); lease.sent && !lease.abandoned && leases_.is_preparation(lease)) {
      return &lease;
    }
  }
  return nullptr;
}

bool Preparations::is_held_up(const Job& job) const {
  if (!job.in_progress() || !(job.plan().has_work() || !job.leases().empty())) {
    return false;
  }
  return std::ranges::all_of(job.leases(), [&](LeaseId id) {
    const Lease& lease = leases_.at(id);
    const Lease* const first = at_work(workers_.at(lease.worker));
    return lease.sent && leases_.is_preparation(lease) && first != nullptr && first->unit.job != job.id();
  });
}

const Lease* Preparations::longest_before(const Job& job, Time now) const {
  const Lease* longest = nullptr;
  for (const auto& [name, worker] : workers_.all()) {
    const Lease* const lease = worker.counts() && !worker.silent() ? at_work(worker) : nullptr;
    if (lease == nullptr || !may_have(worker, job, now)) {
      continue;
    }
    const Job& other = jobs_.at(lease->unit.job);
    const auto times = preempted_.find(other.id());
    const Duration timeout =
        kPreparationTimeout * (1 << (times == preempted_.end() ? 0 : std::min(times->second, kMaxDoublings)));
    if (other.spec().owner != job.spec().owner && other.spec().priority <= job.spec().priority &&
        now >= lease->last_progress + timeout &&
        (longest == nullptr || lease->last_progress < longest->last_progress)) {
      longest = lease;
    }
  }
  return longest;
}

void Preparations::preempt(const Lease& lease, const Job& job, const Event& event) {
  Worker& worker = workers_.at(lease.worker);
  const Job& other = jobs_.at(lease.unit.job);
  event.info(about(other.id(), worker.name(), lease.id),
             "worker {} leaves job {}, which it has prepared for {:.0f} s, because job {} of another user waits",
             worker.name(), other.id().value, to_seconds(event.now - lease.last_progress), job.id().value);
  ++preempted_[other.id()];
  for (const LeaseId id : std::set(worker.leases())) {
    if (const Lease& each = leases_.at(id); each.unit.job == other.id() && leases_.is_preparation(each)) {
      leases_.end(id, {.cancel = true}, event);
    }
  }
  scheduler_.serve(worker, event);
}

void Preparations::tick(const Event& event) {
  if (const std::optional<Time> due = next_deadline(); !due || event.now < *due) {
    return;
  }
  next_check_ = event.now + kSearchInterval;
  std::erase_if(preempted_, [&](const auto& entry) {
    const Job* const job = jobs_.find(entry.first);
    return job == nullptr || !job->in_progress();
  });
  std::vector<JobId> held_up;
  for (const auto& [id, job] : jobs_.all()) {
    if (held_up.size() < kMaxHeldUp && is_held_up(*job)) {
      held_up.push_back(id);
    }
  }
  for (const JobId id : held_up) {
    const Job& job = jobs_.at(id);
    if (const Lease* const lease = is_held_up(job) ? longest_before(job, event.now) : nullptr) {
      preempt(Lease(*lease), job, event);
    }
  }
}

}  // namespace lightmill
