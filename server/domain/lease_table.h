// Table of leases: units, their workers, deadlines and progress.
//
// Owns the leases, their deadlines and ids. Takes grants, renewals, finished tiles, broken streams, and time. Updates
// the worker, the plan or audits of the job, and the queue with each lease. Does not know why a lease opens or ends.
#pragma once

#include <set>
#include <span>
#include <unordered_map>

#include "server/domain/farm_metrics.h"
#include "server/domain/grant_signer.h"
#include "server/domain/job_queue.h"
#include "server/domain/job_table.h"

namespace lightmill {

class LeaseTable {
 public:
  LeaseTable(const CoordinatorLimits& limits, std::uint64_t epoch, const GrantSigner& signer, WorkerRegistry& workers,
             JobTable& jobs, JobQueue& queue, FarmTotals& totals)
      : limits_(limits),
        epoch_(epoch),
        signer_(signer),
        workers_(workers),
        jobs_(jobs),
        queue_(queue),
        totals_(totals) {}

  std::uint64_t epoch() const { return epoch_; }
  LeaseId next_id() { return LeaseId{epoch_ << 32 | ++count_}; }
  LeaseId last_id() const { return LeaseId{epoch_ << 32 | count_}; }
  const Lease* find(LeaseId id) const;
  const Lease& at(LeaseId id) const { return leases_.at(id); }
  const std::unordered_map<LeaseId, Lease>& all() const { return leases_; }

  bool wants_more(const Worker& worker) const;
  /// Opens a lease whose id, unit and flags are set. The plan or the audits already hold its tiles.
  const Lease& open(Worker& worker, Job& job, Lease lease, Time now);
  /// Sends the grant now, or after the commit that it must not overtake.
  void send_grant(Worker& worker, Job& job, LeaseId id, const Event& event);
  /// The grant waits for a commit. The lease does not expire before its grant is sent: a slow store must not make
  /// workers look lost.
  void wait_for_commit(const Worker& worker, Job& job, LeaseId id);
  /// Does nothing if the grant was sent before.
  void was_sent(LeaseId id, Time now);
  /// These grants of `after_commit` were sent.
  void grants_sent(std::span<const LeaseId> leases, Time now);

  /// The lease is done with this tile. Its last tile ends it.
  void tile_done(LeaseId id, TileId tile, bool by_its_worker, const Event& event);
  /// Ends the holds on samples that the film has after this merge. `from`: the lease of the merged result.
  void settle(Job& job, const NodeKey& merged, LeaseId from, const Event& event);
  /// If the lease is an audit, it is done with this tile.
  void audit_done(LeaseId id, TileId tile, const Event& event);
  /// A result of the worker came, perhaps for an earlier lease. Its leases that audit the same samples are done with
  /// this tile.
  void audited_by(const Worker& worker, const NodeKey& key, const Event& event);
  /// The worker will not render this tile of its lease.
  void give_up_tile(LeaseId id, TileId tile, const Event& event);
  struct End {
    bool cancel = false;  ///< tell the worker
    bool lost = false;    ///< count it against the worker
  };
  /// Takes back what remains of a lease.
  void end(LeaseId id, End how, const Event& event);

  void renew(LeaseId id, Time now);
  /// Whether the worker should be working on the lease. It works on its oldest lease, and on a pilot at the same time.
  bool is_worked_on(const Lease& lease) const { return lease.is_pilot() || is_oldest(lease); }
  /// Whether the worker may still prepare the lease: it is a pilot, or the worker has sent no result of the job.
  bool is_preparation(const Lease& lease) const;
  /// The first result of the job from the worker came for this lease.
  void prepared(LeaseId id, double rendering_seconds, Time now);
  /// Whether the worker has sent no result of the lease for too long. It works on its oldest lease first.
  bool is_idle(const Lease& lease, Time now) const;
  /// The worker's stream broke. Its leases expire after `disconnect_grace`, or earlier.
  void abandon(const Worker& worker, Time now);
  /// The worker came back with the lease. This is no progress.
  void resume(LeaseId id, Time now);
  /// The coordinator was stopped for `late`. Every lease has at least its full time again.
  void extend_all(Duration late, Time now);
  /// Next lease whose deadline has passed. It stays in the table. If workers' messages could not be read, renews their
  /// leases instead.
  std::optional<LeaseId> next_expired(Time now);
  std::optional<Time> next_deadline() const;

 private:
  void set_deadline(Lease& lease, Time deadline);
  bool is_oldest(const Lease& lease) const;
  /// Marks the tile done. False if it was done before.
  bool finish_tile(LeaseId id, TileId tile);
  /// Another lease finished a tile of this one sooner. The cost of this tile for this worker is at least its silent
  /// time.
  void note_silence(Worker& worker, const Lease& lease, Time now) const;

  const CoordinatorLimits& limits_;
  const std::uint64_t epoch_;
  const GrantSigner& signer_;
  WorkerRegistry& workers_;
  JobTable& jobs_;
  JobQueue& queue_;
  FarmTotals& totals_;
  std::uint64_t count_ = 0;
  std::unordered_map<LeaseId, Lease> leases_;
  std::set<std::pair<Time, LeaseId>> expiry_;
};

}  // namespace lightmill
