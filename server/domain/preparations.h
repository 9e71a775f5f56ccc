// Preparations: workers that fetch and compile a scene, or run its pilot, and have delivered nothing of the job yet.
//
// If a job of another owner waits for such a worker, it preempts the preparation after a while. So the jobs of one
// owner cannot keep all workers busy without results. Owns the time of the next search, and the number of preemptions
// of each job. JobQueue adds up the preparation time of each owner.
#pragma once

#include "server/domain/scheduler.h"

namespace lightmill {

class Preparations {
 public:
  Preparations(JobTable& jobs, LeaseTable& leases, WorkerRegistry& workers, JobQueue& queue, Scheduler& scheduler)
      : jobs_(jobs), leases_(leases), workers_(workers), queue_(queue), scheduler_(scheduler) {}

  /// Ends preparations that hold up jobs of other owners, if a search is due.
  void tick(const Event& event);
  /// When the next search is due. Nothing while all jobs have one owner, nothing is leased, or leasing is stopped.
  std::optional<Time> next_deadline() const;

 private:
  /// The lease that the worker prepares now; null if there is none.
  const Lease* at_work(const Worker& worker) const;
  /// Whether the job has work, and no worker renders or prepares it.
  bool is_held_up(const Job& job) const;
  /// The longest preparation that this job may preempt; null if there is none.
  const Lease* longest_before(const Job& job, Time now) const;
  void preempt(const Lease& lease, const Job& job, const Event& event);

  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  JobQueue& queue_;
  Scheduler& scheduler_;
  Time next_check_;
  std::map<JobId, std::uint32_t> preempted_;  ///< of jobs in progress
};

}  // namespace lightmill
