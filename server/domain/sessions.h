// Sessions of workers: their start with the leases that workers hold, their messages, and their end.
//
// Owns nothing. WorkerRegistry owns the workers.
#pragma once

#include "server/domain/dismissals.h"

namespace lightmill {

class Sessions {
 public:
  Sessions(const CoordinatorLimits& limits, const GrantSigner& signer, JobTable& jobs, LeaseTable& leases,
           WorkerRegistry& workers, const QuarantineList& quarantine, JobQueue& queue, JobLifeCycle& life_cycle,
           Scheduler& scheduler, Inspections& inspections, Dismissals& dismissals)
      : limits_(limits),
        signer_(signer),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        quarantine_(quarantine),
        queue_(queue),
        life_cycle_(life_cycle),
        scheduler_(scheduler),
        inspections_(inspections),
        dismissals_(dismissals) {}

  void connect(SessionId session, const WorkerHello& hello, const Event& event);
  void disconnected(SessionId session, const Event& event);
  /// The worker drains: it gets no more leases, and its session ends after its last one.
  void leaves(Worker& worker, const Event& event);
  /// An operator asks the worker to drain. NOT_FOUND.
  Status drain(const std::string& worker, const Event& event);
  /// Ends sessions that were silent for too long, if a check is due.
  void end_silent(const Event& event);

  void heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);
  void give_back(Worker& worker, const WorkerReturn& message, const Event& event);
  void refuse(Worker& worker, const WorkerRefusal& refusal, const Event& event);

 private:
  /// The stream ended. The worker's leases wait for it for `disconnect_grace`.
  void end(SessionId session, const Event& event);
  /// Interval for a worker that connects now. It grows with the number of sessions.
  Duration heartbeat_interval() const;
  /// Compares the leases in the hello with those of the table. Returns a forged one, if there is any.
  std::optional<LeaseId> take_back_held(Worker& worker, const WorkerHello& hello, bool other_process,
                                        const Event& event);
  /// `unwanted`: the lease is stale. `forged`: it has a tag that no grant gave to this worker.
  enum class Adoption { adopted, unwanted, forged };
  Adoption adopt(Worker& worker, const HeldLease& held, const Event& event);

  const CoordinatorLimits& limits_;
  const GrantSigner& signer_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  const QuarantineList& quarantine_;
  JobQueue& queue_;
  JobLifeCycle& life_cycle_;
  Scheduler& scheduler_;
  Inspections& inspections_;
  Dismissals& dismissals_;
};

}  // namespace lightmill
