// Sessions: workers connect with the leases that they hold, give work back, refuse it, fall silent and leave.
//
// Owns when a note last said that the farm is full. The workers themselves are WorkerRegistry's.
#pragma once

#include "server/domain/inspections.h"
#include "server/domain/scheduler.h"

namespace lightmill {

class Sessions {
 public:
  Sessions(const CoordinatorLimits& limits, const Grants& grants, JobTable& jobs, LeaseTable& leases,
           WorkerRegistry& workers, const QuarantineList& quarantine, JobQueue& queue, JobLifeCycle& life,
           Scheduler& scheduler, Inspections& inspections)
      : limits_(limits),
        grants_(grants),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        quarantine_(quarantine),
        queue_(queue),
        life_(life),
        scheduler_(scheduler),
        inspections_(inspections) {}

  void connect(SessionId session, const WorkerHello& hello, const Event& event);
  /// Ends the session with a message. `for_now`: for want of room.
  void dismiss(SessionId session, std::string reason, const Event& event, bool for_now = false);
  /// Takes back the lease of a message that cannot be true, if the session's worker has it, and counts the message. Too
  /// many end the session.
  void distrust(SessionId session, LeaseId lease, const Status& error, const Event& event);
  void disconnected(SessionId session, const Event& event);
  /// The worker takes no more leases, and leaves when its last one is done.
  void leaves(Worker& worker, const Event& event);
  /// An operator's request. NOT_FOUND.
  Status ask_to_leave(const std::string& worker, const Event& event);
  /// Ends sessions that have been silent for too long, if it is time to look.
  void end_silent(const Event& event);

  void heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);
  void give_back(Worker& worker, const WorkerReturn& message, const Event& event);
  void refuse(Worker& worker, const WorkerRefusal& refusal, const Event& event);

 private:
  /// The stream is gone. The worker's leases wait for it for a while.
  void end(SessionId session, const Event& event);
  /// For a worker that comes now: the longer, the more are here.
  Duration heartbeat_interval() const;
  void take_back_held(Worker& worker, const WorkerHello& hello, bool other_process, const Event& event);
  bool adopt(Worker& worker, const HeldLease& held, const Event& event);
  /// Takes back what takes too long.
  void look_at_work(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);
  void overran(Worker& worker, const Lease& lease, TileId tile, const Event& event);
  /// Takes the job from those who may not render it any more because of what `worker` has said.
  void withdraw(Job& job, const Worker& worker, const Event& event);

  const CoordinatorLimits& limits_;
  const Grants& grants_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  const QuarantineList& quarantine_;
  JobQueue& queue_;
  JobLifeCycle& life_;
  Scheduler& scheduler_;
  Inspections& inspections_;
  Time next_full_note_{};
};

}  // namespace lightmill
