// Result intake: checks results, merges them into their job's film, and acknowledges them.
//
// Owns nothing. Takes results.
#pragma once

#include "server/domain/dismissals.h"
#include "server/domain/quarantine.h"

namespace lightmill {

class ResultIntake {
 public:
  ResultIntake(const GrantSigner& signer, JobTable& jobs, LeaseTable& leases, WorkerRegistry& workers,
               const QuarantineList& quarantined, JobQueue& queue, Provenance& provenance, JobLifeCycle& life_cycle,
               Scheduler& scheduler, Audits& audits, Quarantine& quarantine, Dismissals& dismissals, FarmTotals& totals)
      : signer_(signer),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        quarantined_(quarantined),
        queue_(queue),
        provenance_(provenance),
        life_cycle_(life_cycle),
        scheduler_(scheduler),
        audits_(audits),
        quarantine_(quarantine),
        dismissals_(dismissals),
        totals_(totals) {}

  void take(SessionId session, WorkerResult result, const Event& event);

 private:
  /// PERMISSION_DENIED unless the samples were granted to the worker. Other errors for results that no renderer sends.
  Status check(const Job& job, const std::string& worker, const WorkerResult& result) const;
  /// Acknowledges an unwanted result, and ends its lease's hold on the tile.
  void drop_unwanted(SessionId session, const WorkerResult& result, const std::string& worker, const Event& event);
  void reject(SessionId session, const WorkerResult& result, const Status& error, const Event& event);
  /// `late`: the worker no longer has its lease.
  void merge(Job& job, const Renderer& by, WorkerResult result, bool late, const Event& event);
  /// Whether the worker has an open lease that wants this tile.
  bool is_granted(const std::string& worker, const WorkerResult& result) const;
  /// CPU seconds that the worker reports, as far as they are possible. 0 if the result is not granted now.
  double seconds_that_count(const std::string& worker, const WorkerResult& result, Time now) const;
  /// Adds the cost of the result to its job and its worker.
  void count_cost(Job& job, const Renderer& by, const WorkerResult& result, const Event& event);
  void count_duplicate(Job& job, const NodeKey& key, const Renderer& by, bool differs, const Event& event);

  const GrantSigner& signer_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  const QuarantineList& quarantined_;
  JobQueue& queue_;
  Provenance& provenance_;
  JobLifeCycle& life_cycle_;
  Scheduler& scheduler_;
  Audits& audits_;
  Quarantine& quarantine_;
  Dismissals& dismissals_;
  FarmTotals& totals_;
};

}  // namespace lightmill
