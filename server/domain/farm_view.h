// View of the farm: jobs, workers, counts and demand, for clients, metrics and autoscalers.
//
// Owns nothing. Takes queries.
#pragma once

#include "server/domain/coordinator.h"
#include "server/domain/quarantine_list.h"
#include "server/domain/wait_reasons.h"

namespace lightmill {

class FarmView {
 public:
  FarmView(const CoordinatorLimits& limits, const JobTable& jobs, const LeaseTable& leases,
           const WorkerRegistry& workers, const QuarantineList& quarantine, const Audits& audits,
           const Scheduler& scheduler, const WaitReasons& waits, const FarmTotals& totals)
      : limits_(limits),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        quarantine_(quarantine),
        audits_(audits),
        scheduler_(scheduler),
        waits_(waits),
        totals_(totals) {}

  /// As clients see it.
  JobStatus status(const Job& job, Time now) const;
  /// With an end that is not stored yet.
  JobStatus decided_status(const Job& job, Time now) const;
  std::vector<JobStatus> jobs(Time now, const JobFilter& filter) const;
  std::size_t count_jobs(const JobFilter& filter) const;
  std::vector<WorkerStatus> workers(Time now, const WorkerFilter& filter) const;
  FarmLoad load() const;
  FarmGauges gauges(Time now) const;

  // ---- demand: how many workers the farm could use, for autoscalers ----
  std::uint32_t wanted_workers(Time now) const;
  bool wants_workers() const;

 private:
  JobStatus status(const Job& job, Time now, WorkerKinds& kinds) const;
  JobStatus decided_status(const Job& job, Time now, WorkerKinds& kinds) const;
  WorkerStatus status(const Worker& worker, Time now) const;

  const CoordinatorLimits& limits_;
  const JobTable& jobs_;
  const LeaseTable& leases_;
  const WorkerRegistry& workers_;
  const QuarantineList& quarantine_;
  const Audits& audits_;
  const Scheduler& scheduler_;
  const WaitReasons& waits_;
  const FarmTotals& totals_;
};

}  // namespace lightmill
