// Sessions of workers: they connect with their leases, give work back, refuse it, fall silent and leave.
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
  /// The worker takes no more leases, and leaves after its last one.
  void leaves(Worker& worker, const Event& event);
  /// Request of an operator. NOT_FOUND.
  Status drain(const std::string& worker, const Event& event);
  /// Ends sessions that were silent for too long, if a check is due.
  void end_silent(const Event& event);

  void heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);
  void give_back(Worker& worker, const WorkerReturn& message, const Event& event);
  void refuse(Worker& worker, const WorkerRefusal& refusal, const Event& event);

 private:
  /// The stream ended. The worker's leases wait for it for `disconnect_grace`.
  void end(SessionId session, const Event& event);
  /// For a worker that connects now. It grows with the number of sessions.
  Duration heartbeat_interval() const;
  /// Returns a lease with a tag of no grant to this worker, if the hello lists one.
  std::optional<LeaseId> take_back_held(Worker& worker, const WorkerHello& hello, bool other_process,
                                        const Event& event);
  enum class Adoption { adopted, unwanted, forged };
  /// `forged`: a tag is of no grant to this worker. Leases that are merely stale are unwanted.
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
