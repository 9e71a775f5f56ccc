// Overruns: tiles and pilots that take too much CPU time. Their leases end, and the job gets smaller units.
//
// Owns nothing. Takes the times in workers' heartbeats.
#pragma once

#include "server/domain/scheduler.h"

namespace lightmill {

class Overruns {
 public:
  Overruns(const CoordinatorLimits& limits, JobTable& jobs, LeaseTable& leases, JobQueue& queue,
           JobLifeCycle& life_cycle, Scheduler& scheduler)
      : limits_(limits), jobs_(jobs), leases_(leases), queue_(queue), life_cycle_(life_cycle), scheduler_(scheduler) {}

  /// Takes back what exceeds `tile_cpu_seconds`.
  void check(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);

 private:
  void take_back(Worker& worker, const Lease& lease, TileId tile, const Event& event);
  void take_back_pilot(Worker& worker, const Lease& lease, const Event& event);

  const CoordinatorLimits& limits_;
  JobTable& jobs_;
  LeaseTable& leases_;
  JobQueue& queue_;
  JobLifeCycle& life_cycle_;
  Scheduler& scheduler_;
};

}  // namespace lightmill
