// Queue of the jobs that have work to lease, in the order in which workers get it.
//
// Owns each job's fair share of thread time. Takes every change of a job's work. FairQueue has the order.
#pragma once

#include "server/domain/job.h"
#include "server/domain/workers.h"
#include "server/scheduling/fair_queue.h"

namespace lightmill {

class JobQueue {
 public:
  JobQueue(const CoordinatorLimits& limits, const WorkerRegistry& workers) : limits_(limits), workers_(workers) {}

  /// The job is new, or comes back after a pause or its end. It gets a fresh share.
  void enter(const Job& job);
  /// To call after every change of the job's work or place.
  void refresh(const Job& job);
  /// The job had a thread for so long, and no result came of it.
  void add_lost(const Job& job, double seconds);
  /// The job has ended.
  void remove(JobId job);

  bool empty() const { return queue_.empty(); }
  bool contains(JobId job) const { return queue_.contains(job); }
  auto begin() const { return queue_.begin(); }
  auto end() const { return queue_.end(); }

 private:
  struct Share {
    double base = 0;      ///< thread seconds that do not count: what other jobs had when it entered
    double at_start = 0;  ///< its place when it last entered
  };
  /// Thread seconds that the job got since it entered, with those of its leases.
  double given_seconds(const Job& job) const;
  /// Whether its first picture is not complete, and goes before the work of other jobs.
  bool is_fresh(const Job& job) const;

  const CoordinatorLimits& limits_;
  const WorkerRegistry& workers_;
  FairQueue queue_;
  std::map<JobId, Share> shares_;  ///< of active jobs
};

}  // namespace lightmill
