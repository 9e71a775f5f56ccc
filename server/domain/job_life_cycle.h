// Life cycle of jobs: they are submitted, start, reach their limits, end, are extended or reopened, and are deleted.
//
// Owns which jobs wait for a moment: their time, the return of workers after a start, the end of their audits. Takes:
// clients' requests, lost leases, time. Handing out its work is the scheduler's.
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
  /// Returns false if the job has reached its limit, and ends. So does extend().
  Result<bool> resume(JobId id, const Event& event);
  /// UNAVAILABLE if its film is in the store alone.
  Result<bool> extend(JobId id, const Extension& to, const Event& event);
  /// Returns whether the priority changed.
  Result<bool> set_priority(JobId id, std::int32_t priority, const Event& event);
  Status remove(JobId id, const Event& event);

  // ---- states ----
  /// The store gave the job back.
  void restored(Job& job, Time now);
  /// The job gets this worker's class.
  void start(Job& job, const Worker& worker, const Event& event);
  /// Takes back the class of a job without results and leases, if nobody who is here may render it in that class: any
  /// worker may start it again.
  void unbind_if_unwanted(Job& job, const Event& event);
  void pause(Job& job, std::string reason, const Event& event);
  void finish(Job& job, JobState state, std::string reason, const Event& event);
  /// Ends the job if it has reached a limit, or nobody can render it. Returns whether it has ended.
  bool finish_if_complete(Job& job, const Event& event);
  /// Closes the plan of a job whose seconds are over.
  void close_if_time_is_up(Job& job, const Event& event);
  /// A job that was done is in progress again: its film has lost something, or its goal is a new one. If its film is in
  /// the store alone, that waits for film_came().
  void reopen(Job& job, Time now);
  /// The film of an ended job is in memory again. `whole`: as it was at the job's end.
  void film_came(Job& job, bool whole, const Event& event);
  /// The next tick asks whether the job is complete.
  void look_again(JobId job) { ending_.insert(job); }

  // ---- leases ----
  /// Takes a lease back; its job may be complete without it.
  void end_lease(LeaseId id, LeaseTable::End how, const Event& event);
  /// The worker is not heard of any more. What it was to render may be why, which may fail the job.
  void lose_lease(LeaseId id, bool cancel, const Event& event);

  // ---- time ----
  void tick(const Event& event);
  std::optional<Time> next_deadline() const;

 private:
  /// NOT_FOUND. FAILED_PRECONDITION if the job has ended and should not have, or the other way round: it cannot be
  /// `what`.
  Result<Job*> get(JobId id, bool ended, const char* what);
  void expire_leases(const Event& event);
  /// A worker that is heard, but sends no results, does not get the job again if others may render it.
  void leave_to_others(const Lease& lost, const Event& event);
  void delete_old(const Event& event);
  void queue_again(Job& job);
  void forget(JobId id, const Event& event);
  /// Fails the job if two identities say that nobody can render it, or one does and no other is here to try. Returns
  /// whether it has ended.
  bool fail_if_refused(Job& job, const Event& event);
  /// The job has reached this limit. False if audits are still to come.
  bool complete(Job& job, GoalLimit limit, std::string reason, const Event& event);
  void make_plan(Job& job, Time now) const;

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
  std::set<JobId> restored_;  ///< to be looked at by the first tick, or held back until their time
  std::set<JobId> ending_;    ///< to be looked at by each tick
  Time next_ending_look_, next_old_look_;
};

}  // namespace lightmill
