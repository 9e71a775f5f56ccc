// Copies: idle workers also get the leases that others are late with, near the end of a job.
//
// Owns when it looks next, and at which worker the last look ended. After Zaharia et al., Improving MapReduce
// Performance in Heterogeneous Environments (2008): the leases that will take longest go first.
#pragma once

#include "server/domain/scheduler.h"

namespace lightmill {

class Copies {
 public:
  Copies(const CoordinatorLimits& limits, JobTable& jobs, LeaseTable& leases, WorkerRegistry& workers, Pilots& pilots,
         const Scheduler& scheduler)
      : limits_(limits), jobs_(jobs), leases_(leases), workers_(workers), pilots_(pilots), scheduler_(scheduler) {}

  /// Gives idle workers copies, if a look is due.
  void look(const Event& event);
  /// When the next look is due; nothing if no worker is idle, or nothing is leased.
  std::optional<Time> next_look() const;

 private:
  /// Leases that may be copied, each with minus the seconds that it will take: the longest first.
  std::vector<std::pair<double, LeaseId>> late_leases(Time now) const;
  bool may_be_copied(const Lease& lease, Time now) const;
  /// Gives the worker a copy of one of these leases. Leases that need no other copy are taken out.
  void copy_one(Worker& worker, std::vector<std::pair<double, LeaseId>>& late, const Event& event);
  /// Of one thread of the worker for one tile of the lease: as measured, or as other workers take.
  double tile_seconds(const Worker& worker, const Lease& lease) const;
  /// Until the lease's own worker will have done it, with all leases that it has before it.
  double seconds_left(const Lease& lease, Time now) const;
  /// Copies to the worker what is still to be done of the lease, or the end of that. False if there is nothing.
  bool copy(const Lease& lease, Worker& worker, const Event& event);
  /// The worker audits some of it instead of the lease's own. False if there is nothing that it may.
  bool take_over_audit(const Lease& lease, Worker& worker, const Event& event);
  void open_copy(Worker& worker, Job& job, Lease lease, const Event& event);

  const CoordinatorLimits& limits_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  Pilots& pilots_;
  const Scheduler& scheduler_;
  Time next_look_;
  std::string last_worker_;  ///< the next look begins behind it
};

}  // namespace lightmill
