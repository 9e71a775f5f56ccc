// Scheduler: leases the work of the queue's jobs to workers that want more.
//
// Owns the limit on the rate of results, and the reason why leasing is stopped. Takes workers to serve, results, and
// the waits that workers report. The queue decides which job is next, and the job's plan which of its samples.
#pragma once

#include "server/domain/pilots.h"
#include "server/scheduling/result_rate_control.h"

namespace lightmill {

class Scheduler {
 public:
  Scheduler(const CoordinatorLimits& limits, Time now, JobTable& jobs, LeaseTable& leases, WorkerRegistry& workers,
            JobQueue& queue, JobLifeCycle& life_cycle, Pilots& pilots)
      : limits_(limits),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        queue_(queue),
        life_cycle_(life_cycle),
        pilots_(pilots),
        result_rate_(limits.result_bytes_per_second, now) {}

  /// Gives the worker leases until it wants no more, or until there is nothing for it. Then it is idle.
  void serve(Worker& worker, const Event& event);
  /// Serves all idle workers, one lease each in turn, so that the work is spread over them. The worker that has waited
  /// longest comes first. So work that one identity gives back or loses goes to others.
  void serve_all(const Event& event);
  /// Why leasing is stopped; empty while it is not.
  const std::string& held() const { return held_; }
  void hold(const std::string& why, const Event& event);

  // ---- sizes of units ----
  /// Pixel samples of the job that the worker may get now. A worker's own speed and threads would allow more, but
  /// no one can check them.
  double most_pixel_samples(const Worker& worker, const Job& job, const UnitAim& aim, Time now) const;
  UnitAim aim_for(const Worker& worker, const Job& job, Time now) const;
  void result_received(const WorkerResult& result, Time now);
  /// Lowers the rate if results wait too long for their acknowledgement. Else raises it.
  void update_result_rate(const Event& event);
  /// Results waited for another reason than their number.
  void note_stall(Time now) { result_rate_.note_stall(now); }
  double result_bytes_per_second() const { return result_rate_.bytes_per_second(); }

 private:
  bool serve_once(Worker& worker, const Event& event);
  bool grant_next(Worker& worker, const Event& event);
  /// Whether the worker may give the job its fingerprint class. A worker can claim a class of its own, where no other
  /// worker can audit it. So while some class has two identities, jobs with audits start only in such a class.
  bool may_start(const Worker& worker, const Job& job) const;
  /// Grants work of the job. Null: this worker gets nothing from any job, because the next unit needs a worker without
  /// other leases.
  std::optional<bool> grant(Worker& worker, Job& job, const Event& event);
  bool grant_audit(Worker& worker, Job& job, const Event& event);
  /// Whether enough of the job is leased until its first result comes.
  bool enough_is_tried(const Job& job) const;

  const CoordinatorLimits& limits_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  JobQueue& queue_;
  JobLifeCycle& life_cycle_;
  Pilots& pilots_;
  std::string held_;
  ResultRateControl result_rate_;
  bool slowed_ = false;  ///< a note has reported a lowered rate
};

}  // namespace lightmill
