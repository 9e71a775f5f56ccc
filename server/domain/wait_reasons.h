// Reasons for which jobs wait.
//
// Owns the missing assets, each with the time of the last request. Takes these requests.
#pragma once

#include "server/domain/scheduler.h"

namespace lightmill {

/// Connected workers by renderer version and class. They are collected when the first job needs them. With many jobs
/// and workers, most jobs look at a few kinds.
class WorkerKinds {
 public:
  explicit WorkerKinds(const WorkerRegistry& workers) : workers_(workers) {}
  using ByKind = std::map<std::pair<std::string_view, std::string_view>, std::vector<const Worker*>>;
  const ByKind& get();
  bool any_may_render(const Job& job);

 private:
  const WorkerRegistry& workers_;
  std::optional<ByKind> kinds_;
};

struct Wait {
  WaitReason reason = WaitReason::storage;
  std::string text = {};  ///< empty if the job does not wait, because a connected worker may render it
};

class WaitReasons {
 public:
  WaitReasons(const JobTable& jobs, const LeaseTable& leases, const Audits& audits, const Scheduler& scheduler)
      : jobs_(jobs), leases_(leases), audits_(audits), scheduler_(scheduler) {}

  Wait of(const Job& job, Time now, WorkerKinds& kinds) const;
  /// Workers ask for this asset, and the server does not have it. The status of jobs that use it says so until workers
  /// stop asking.
  void asset_is_missing(const Sha256& digest, const Event& event);

 private:
  std::string reason_of_missing(const Job& job, Time now) const;
  /// Why the job makes no progress, if none of its leases has brought a result for long.
  std::string reason_of_standstill(const Job& job, Time now) const;

  const JobTable& jobs_;
  const LeaseTable& leases_;
  const Audits& audits_;
  const Scheduler& scheduler_;
  std::map<Sha256, Time> missing_assets_;
};

}  // namespace lightmill
