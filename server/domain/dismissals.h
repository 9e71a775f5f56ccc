// Dismissals: sessions that the coordinator ends with a message, for example after too many invalid results.
//
// Owns the time of the next note that the farm is full.
#pragma once

#include "server/domain/inspections.h"
#include "server/domain/scheduler.h"

namespace lightmill {

class Dismissals {
 public:
  Dismissals(const CoordinatorLimits& limits, LeaseTable& leases, WorkerRegistry& workers, JobLifeCycle& life_cycle,
             Scheduler& scheduler, Inspections& inspections)
      : limits_(limits),
        leases_(leases),
        workers_(workers),
        life_cycle_(life_cycle),
        scheduler_(scheduler),
        inspections_(inspections) {}

  /// Ends the session with a message. `for_now`: because the farm is full.
  void dismiss(SessionId session, std::string reason, const Event& event, bool for_now = false);
  /// For an invalid message. Takes back the lease that it names, if the session's worker has it. Counts the message for
  /// the worker's identity, and calls `judge`.
  void distrust(SessionId session, LeaseId lease, const Status& error, const Event& event);
  /// Ends the session if `bad_results` has reached the limit. Otherwise its worker gets work again. `error`: of the
  /// last bad result.
  void count_violation(SessionId session, std::uint32_t bad_results, const Status& error, const Event& event);

 private:
  const CoordinatorLimits& limits_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  JobLifeCycle& life_cycle_;
  Scheduler& scheduler_;
  Inspections& inspections_;
  Time next_full_note_{};
};

}  // namespace lightmill
