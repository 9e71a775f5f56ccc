// Life cycle of jobs: submission, start, limits, end, extension, reopening and deletion.
//
// Owns the sets of jobs that wait: for a time limit, for workers after a restart, or for audits. Takes requests of
// clients, lost leases, and time. The scheduler leases the work.
#pragma once

#include <set>

#include "server/domain/audits.h"
#include "server/domain/films.h"

namespace lightmill {

class JobLifeCycle {
 public:
  JobLifeCycle(const CoordinatorLimits& limits, JobTable& jobs, Films& films, LeaseTable& leases,
               WorkerRegistry& workers, JobQueue& queue, const Audits& audits, Provenance& provenance,
               FarmTotals& totals)
      : limits_(limits),
        jobs_(jobs),
        films_(films),
        leases_(leases),
        workers_(workers),
        queue_(queue),
        audits_(audits),
        provenance_(provenance),
        totals_(totals) {}

  // ---- requests; errors have the codes that render_service.proto states ----
  Result<JobId> submit(const JobSpec& spec, const MethodNotes& notes, const Event& event);
  Status cancel(JobId id, const Event& event);
  Status pause(JobId id, const Event& event);
  /// False if the job has reached its limit, and ends. The same holds for extend().
  Result<bool> resume(JobId id, const Event& event);
  /// UNAVAILABLE if its film is only in the store.
  Result<bool> extend(JobId id, const Extension& to, const Event& event);
  /// Whether the priority changed.
  Result<bool> set_priority(JobId id, std::int32_t priority, const Event& event);
  Status remove(JobId id, const Event& event);

  // ---- states ----
  /// The job was read from the store.
  void restored(Job& job, Time now);
  /// The job gets this worker's class.
  void start(Job& job, const Worker& worker, const Event& event);
  /// Takes the class back from a job without results and leases, if no connected worker may render it in that class.
  /// Then any worker may start it.
  void unbind_if_unwanted(Job& job, const Event& event);
  void pause(Job& job, std::string reason, const Event& event);
  /// `limit`: the one that ended it, if any.
  void finish(Job& job, JobState state, std::string reason, const Event& event, GoalLimit limit = GoalLimit::none);
  /// Ends the job if it has reached a limit, or if workers refused it. Returns whether it has ended.
  bool finish_if_complete(Job& job, const Event& event);
  /// Closes the plan of a job whose seconds are over.
  void close_if_time_is_up(Job& job, const Event& event);
  /// A done job is in progress again: its film has lost nodes, or it has a new goal. If its film is only in the store,
  /// this waits for film_loaded().
  void reopen(Job& job, Time now);
  /// The film of an ended job is in memory again. `whole`: with all its nodes.
  void film_loaded(Job& job, bool whole, const Event& event);
  /// The next tick checks whether the job is complete.
  void check_again(JobId job) { ending_.insert(job); }

  // ---- leases ----
  /// Takes a lease back. Its job may be complete without it.
  void end_lease(LeaseId id, LeaseTable::End how, const Event& event);
  /// The worker is lost. The work of the lease may be the cause, which may fail the job.
  void lose_lease(LeaseId id, bool cancel, const Event& event);
  /// The worker gave back a lease that it had begun, without results. The time counts against its identity.
  void given_back(const Lease& lease, const Event& event);
  /// Takes the job from workers that may no longer render it after the refusal or losses of `worker`.
  void withdraw(Job& job, const Worker& worker, const Event& event);

  // ---- time ----
  void tick(const Event& event);
  std::optional<Time> next_deadline() const;

 private:
  /// Finds an ended (`ended`) or active job. NOT_FOUND. FAILED_PRECONDITION if it is in the other state; then the
  /// message names `what`.
  Result<Job*> get(JobId id, bool ended, const char* what);
  void expire_leases(const Event& event);
  /// A worker that sends heartbeats but no results for this time does not get the job again, if others may render it.
  void leave_to_others(const Lease& lost, Duration silence, const Event& event);
  void delete_old(const Event& event);
  void queue_again(Job& job);
  void forget(JobId id, const Event& event);
  /// Fails the job if two identities refused it, or one did and no other worker can try. Returns whether it has ended.
  bool fail_if_refused(Job& job, const Event& event);
  /// The job has reached this limit. False if audits are still to come.
  bool complete(Job& job, GoalLimit limit, std::string reason, const Event& event);

  const CoordinatorLimits& limits_;
  JobTable& jobs_;
  Films& films_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  JobQueue& queue_;
  const Audits& audits_;
  Provenance& provenance_;
  FarmTotals& totals_;
  std::set<JobId> timed_;     ///< active, with a goal in seconds
  std::set<JobId> restored_;  ///< to check once their `held_until` has passed
  std::set<JobId> ending_;    ///< to check in each tick
  Time next_ending_check_, next_old_check_;
};

}  // namespace lightmill
