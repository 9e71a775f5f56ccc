// Quarantine: excludes workers, takes their leases back, and has their work rendered again.
//
// Owns nothing: QuarantineList has the list. Takes disputes, and requests of operators.
#pragma once

#include "server/domain/scheduler.h"

namespace lightmill {

class Quarantine {
 public:
  Quarantine(QuarantineList& list, JobTable& jobs, LeaseTable& leases, WorkerRegistry& workers, JobQueue& queue,
             Provenance& provenance, JobLifeCycle& life_cycle, Scheduler& scheduler, FarmTotals& totals)
      : list_(list),
        jobs_(jobs),
        leases_(leases),
        workers_(workers),
        queue_(queue),
        provenance_(provenance),
        life_cycle_(life_cycle),
        scheduler_(scheduler),
        totals_(totals) {}

  /// Acts on a dispute about these samples. Wrong nodes are rendered again. Workers with wrong results go into
  /// quarantine, and their work is undone. If the program is at fault, the job is paused.
  void resolve(Job& job, const NodeKey& key, const Dispute& dispute, const Event& event);

  /// Drops the film's node that contains these samples, with its records and audits.
  void drop_node(Job& job, TileId tile, SampleRange within, const Event& event);

  // ---- requests of operators, by a worker's name ----
  /// NOT_FOUND unless the worker is connected or the farm has results of it.
  Status put(const std::string& worker, const std::string& reason, bool render_again, const Event& event);
  /// NOT_FOUND unless the worker, or another one of its identity, is in quarantine.
  Status release(const std::string& worker, const Event& event);

 private:
  /// Puts the worker and all others of its identity into quarantine.
  void put(const Renderer& faulty, const std::string& reason, const Event& event);
  /// Has all nodes with parts of `faulty`, or of others that share its quarantine, rendered again.
  void undo_work_of(const Renderer& faulty, const Event& event);
  void pause_for_bug(Job& job, const NodeKey& key, const Dispute& dispute, const Event& event);
  void hold(Worker& worker, const std::string& reason, const Event& event);
  /// Workers that are no longer in the list get work again.
  void release_unlisted(const Event& event);

  QuarantineList& list_;
  JobTable& jobs_;
  LeaseTable& leases_;
  WorkerRegistry& workers_;
  JobQueue& queue_;
  Provenance& provenance_;
  JobLifeCycle& life_cycle_;
  Scheduler& scheduler_;
  FarmTotals& totals_;
};

}  // namespace lightmill
