// Queue of the jobs that have work to give, in the order in which workers are offered them.
//
// Owns each job's fair share of thread time. Takes: every change of what a job has to give. The order itself is
// FairQueue's.
#pragma once

#include "server/domain/jobs.h"
#include "server/domain/workers.h"
#include "server/scheduling/fair_queue.h"

namespace lightmill {

class JobQueue {
 public:
  JobQueue(const CoordinatorLimits& limits, const WorkerRegistry& workers) : limits_(limits), workers_(workers) {}

  /// The job is new, or comes again after a pause or its end: with a fresh share.
  void enter(Job& job);
  /// After anything that changes what the job has to give, or its place.
  void refresh(Job& job);
  void remove(JobId job) { queue_.remove(job); }

  bool empty() const { return queue_.empty(); }
  bool contains(JobId job) const { return queue_.contains(job); }
  auto begin() const { return queue_.begin(); }
  auto end() const { return queue_.end(); }

 private:
  /// Thread seconds that the job got since it came, with those of its leases.
  static double given_seconds(const Job& job);
  /// Whether its first picture is still to come, and may go before other jobs' next ones.
  bool is_fresh(const Job& job) const;

  const CoordinatorLimits& limits_;
  const WorkerRegistry& workers_;
  FairQueue queue_;
};

}  // namespace lightmill
