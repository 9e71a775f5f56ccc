// Copies: second leases of late work for idle workers, near the end of a job (speculative execution).
//
// Owns the time of the next search, and the worker at which the last search ended. After Zaharia et al., Improving
// MapReduce Performance in Heterogeneous Environments (2008): the leases with the longest remaining time are copied
// first.
#pragma once

#include "server/domain/scheduler.h"

namespace lightmill {

class Copies {
 public:
  Copies(const CoordinatorLimits& limits, JobTable& jobs, LeaseTable& leases, WorkerRegistry& workers, Pilots& pilots,
         const Scheduler& scheduler)
      : limits_(limits), jobs_(jobs), leases_(leases), workers_(workers), pilots_(pilots), scheduler_(scheduler) {}

  /// Gives copies to idle workers, if a search is due.
  void tick(const Event& event);
  /// When the next search is due. Nothing if no worker is idle, nothing is leased, or leasing is stopped.
  std::optional<Time> next_deadline() const;

 private:
  struct Late {
    double seconds;  ///< until its worker finishes it
    LeaseId lease;
    bool for_others = false;  ///< only workers of another identity may copy what is left of it
  };
  /// Leases that may be copied, the latest first.
  std::vector<Late> late_leases(Time now) const;
  bool may_be_copied(const Lease& lease, Time now) const;
  /// Gives the worker a copy of one of these leases. Removes leases that need no other copy.
  void copy_one(Worker& worker, std::vector<Late>& late, const Event& event);
  /// Whether the worker may have a copy of work that these leases hold. One copy is enough, unless one identity holds
  /// the original and the copy. Then another identity may have a second copy.
  template <class Leases>
  bool may_also_hold(const Worker& worker, const Leases& holders) const;
  /// Seconds that a thread of the worker needs for one tile of the lease: its own measurement, or that of the job.
  double tile_seconds(const Worker& worker, const Lease& lease) const;
  /// Seconds until the lease's own worker finishes it, after all its earlier leases.
  double seconds_left(const Lease& lease, Time now) const;
  /// Copies the remaining tiles of the lease to the worker, or the last of them. False if there are none.
  bool copy(const Lease& lease, Worker& worker, const Event& event);
  /// Moves tiles of an audit lease to this worker. False if it may audit none of them.
  bool take_over_audit(const Lease& lease, Worker& worker, const Event& event);
  void open_copy(Worker& worker, Job& job, Lease lease, const Event& event);

  const CoordinatorLimits& limits_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  Pilots& pilots_;
  const Scheduler& scheduler_;
  Time next_check_;
  std::string last_worker_;  ///< the next search begins after it
};

}  // namespace lightmill
