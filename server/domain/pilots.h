// Pilots: leases without tiles, whose workers choose a job's method and the share of samples of each tile.
//
// Owns nothing. Takes grants and workers' choices. A pilot depends only on the job. If it is lost, it is granted again,
// and gives the same result.
#pragma once

#include "server/domain/job_life_cycle.h"

namespace lightmill {

class Pilots {
 public:
  Pilots(LeaseTable& leases, JobTable& jobs, JobQueue& queue, JobLifeCycle& life_cycle)
      : leases_(leases), jobs_(jobs), queue_(queue), life_cycle_(life_cycle) {}

  /// A worker runs one pilot at a time.
  static bool may_have(const Worker& worker, const Job& job, Time now);
  /// If the job has no class, it gets the worker's.
  void grant(Worker& worker, Job& job, const Event& event);
  /// Takes the choice of a pilot. False if its lease was lost meanwhile. An error if the report is invalid.
  Result<bool> report(Worker& worker, const PilotReport& report, const Event& event);

 private:
  LeaseTable& leases_;
  JobTable& jobs_;
  JobQueue& queue_;
  JobLifeCycle& life_cycle_;
};

}  // namespace lightmill
