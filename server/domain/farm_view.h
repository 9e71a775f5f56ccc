// View of the farm: jobs, workers, counts and demand, for clients, metrics and autoscalers.
//
// Owns the missing assets, each with the time of the last request. Changes nothing else.
#pragma once

#include "server/domain/coordinator.h"
#include "server/domain/quarantine_list.h"
#include "server/domain/scheduler.h"

namespace lightmill {

class FarmView {
 public:
  FarmView(const CoordinatorLimits& limits, const JobTable& jobs, const LeaseTable& leases,
           const WorkerRegistry& workers, const QuarantineList& quarantine, const Audits& audits,
           const Scheduler& scheduler, const FarmTotals& totals)
      : limits_(limits),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        quarantine_(quarantine),
        audits_(audits),
        scheduler_(scheduler),
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

  // ---- demand.cpp ----
  std::uint32_t wanted_workers(Time now) const;
  bool wants_workers() const;

  // ---- wait_reasons.cpp ----
  /// Workers ask for this asset, and the server does not have it. The status of jobs that use it says so until workers
  /// stop asking.
  void asset_is_missing(const Sha256& digest, const Event& event);

 private:
  /// Connected workers by renderer version and class.
  using WorkerKinds = std::map<std::pair<std::string_view, std::string_view>, std::vector<const Worker*>>;
  /// The kinds of an event, collected when the first job needs them. With many jobs and workers, most jobs look at a
  /// few kinds.
  class KindsOfEvent {
   public:
    explicit KindsOfEvent(const WorkerRegistry& workers) : workers_(workers) {}
    const WorkerKinds& get();

   private:
    const WorkerRegistry& workers_;
    std::optional<WorkerKinds> kinds_;
  };

  JobStatus status(const Job& job, Time now, KindsOfEvent& kinds) const;
  JobStatus decided_status(const Job& job, Time now, KindsOfEvent& kinds) const;
  struct Wait {
    WaitReason reason = WaitReason::storage;
    std::string text = {};  ///< empty if the job does not wait, because a connected worker may render it
  };
  Wait wait_of(const Job& job, Time now, KindsOfEvent& kinds) const;
  std::string reason_of_missing(const Job& job, Time now) const;
  static std::string wait_for_lost(const Sha256& asset);
  /// Why the job stands still, if no lease of it has brought a result for long.
  std::string reason_of_standstill(const Job& job, Time now) const;
  static Wait why_none_may(const Job& job, const WorkerKinds& kinds);
  static bool any_may_render(const Job& job, const WorkerKinds& kinds);
  WorkerStatus status(const Worker& worker, Time now) const;

  const CoordinatorLimits& limits_;
  const JobTable& jobs_;
  const LeaseTable& leases_;
  const WorkerRegistry& workers_;
  const QuarantineList& quarantine_;
  const Audits& audits_;
  const Scheduler& scheduler_;
  const FarmTotals& totals_;
  std::map<Sha256, Time> missing_assets_;
};

}  // namespace lightmill
