// Pilots: leases without tiles, whose workers choose a job's method and say what part of its samples each tile gets.
//
// Owns nothing. A pilot is a function of the job alone: if it is lost it is granted again, and comes to the same.
#pragma once

#include "server/domain/job_life_cycle.h"

namespace lightmill {

class Pilots {
 public:
  Pilots(LeaseTable& leases, JobTable& jobs, JobQueue& queue, JobLifeCycle& life)
      : leases_(leases), jobs_(jobs), queue_(queue), life_(life) {}

  static bool may_have(const Worker& worker, const Job& job, Time now);
  /// The worker's class becomes the job's, if it has none.
  void grant(Worker& worker, Job& job, const Event& event);
  /// Takes the choice of a pilot. False if its lease was lost meanwhile. An error if it cannot be true.
  Result<bool> report(Worker& worker, const PilotReport& report, const Event& event);

 private:
  LeaseTable& leases_;
  JobTable& jobs_;
  JobQueue& queue_;
  JobLifeCycle& life_;
};

}  // namespace lightmill
