// Queue of the jobs that have work to lease, in the order in which workers get it.
//
// Owns each job's fair share of thread time, and the time that workers spent on preparations for each owner. Takes
// every change of a job's work. FairQueue has the order.
#pragma once

#include "server/domain/job.h"
#include "server/domain/worker_registry.h"
#include "server/scheduling/fair_queue.h"

namespace lightmill {

class JobQueue {
 public:
  JobQueue(const CoordinatorLimits& limits, const WorkerRegistry& workers) : limits_(limits), workers_(workers) {}

  /// The job is new, or comes back after a pause or its end. It gets a fresh share.
  void enter(const Job& job);
  /// Call it after every change of the job's work or place.
  void refresh(const Job& job);
  /// The job had a thread for this time, without a result.
  void add_lost(const Job& job, double seconds);
  /// Adds a worker's time for a pilot, or for a job without results from this worker. Times below a second do not
  /// count. The sum delays those jobs of the owner that have no result yet.
  void add_preparation(const Job& job, double seconds, Time now);
  /// The job has ended.
  void remove(const Job& job);
  /// Moves the job if its owner's preparation time changed since it got its place. Returns whether it left the queue,
  /// or the other entry comes before it now.
  bool fell_behind(const Job& job, const FairQueue::Entry* other);
  /// Owners of active jobs.
  std::size_t owners() const { return active_.size(); }

  bool empty() const { return queue_.empty(); }
  bool contains(JobId job) const { return queue_.contains(job); }
  auto begin() const { return queue_.begin(); }
  auto end() const { return queue_.end(); }

 private:
  struct Share {
    double base = 0;      ///< thread seconds that do not count: what other jobs had when it entered
    double at_start = 0;  ///< its place when it last entered
  };
  /// Preparation time of an owner's jobs.
  struct Debt {
    double seconds = 0;
    Time last;  ///< of the latest addition
  };
  /// The owner's preparation time. 0 for a job with results, and while all jobs have one owner.
  double owed_seconds(const Job& job) const;
  /// Thread seconds that the job got since it entered, with those of its leases.
  double given_seconds(const Job& job) const;
  /// Whether the job's first picture is incomplete. Then its work goes before that of other jobs.
  bool is_fresh(const Job& job) const;

  const CoordinatorLimits& limits_;
  const WorkerRegistry& workers_;
  FairQueue queue_;
  std::map<JobId, Share> shares_;                  ///< of active jobs
  std::map<std::string, std::set<JobId>> active_;  ///< by owner
  std::map<std::string, Debt> debts_;              ///< by owner
};

}  // namespace lightmill
