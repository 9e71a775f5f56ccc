// Sessions of workers: they connect with their leases, give work back, refuse it, fall silent and leave.
//
// Owns only the time of the next note that the farm is full. WorkerRegistry owns the workers.
#pragma once

#include "server/domain/inspections.h"
#include "server/domain/scheduler.h"

namespace lightmill {

class Sessions {
 public:
  Sessions(const CoordinatorLimits& limits, const GrantSigner& signer, JobTable& jobs, LeaseTable& leases,
           WorkerRegistry& workers, const QuarantineList& quarantine, JobQueue& queue, JobLifeCycle& life_cycle,
           Scheduler& scheduler, Inspections& inspections)
      : limits_(limits),
        signer_(signer),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        quarantine_(quarantine),
        queue_(queue),
        life_cycle_(life_cycle),
        scheduler_(scheduler),
        inspections_(inspections) {}

  void connect(SessionId session, const WorkerHello& hello, const Event& event);
  /// Ends the session with a message. `for_now`: because the farm is full.
  void dismiss(SessionId session, std::string reason, const Event& event, bool for_now = false);
  /// Takes back the lease of an invalid message, if the session's worker has it. Counts the message for the worker's
  /// identity. Too many end the session.
  void distrust(SessionId session, LeaseId lease, const Status& error, const Event& event);
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
  /// Ends the session if these are too many bad results.
  void judge(SessionId session, std::uint32_t bad_results, const Status& error, const Event& event);
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
  /// Takes back tiles and pilots that take too long.
  void check_overruns(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);
  void overran(Worker& worker, const Lease& lease, TileId tile, const Event& event);
  void pilot_overran(Worker& worker, const Lease& lease, const Event& event);

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
  Time next_full_note_{};
};

}  // namespace lightmill
