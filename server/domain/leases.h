// Table of leases: which unit is lent to which worker, until when, and how much of it is done.
//
// Owns the leases, their deadlines and their numbers. Takes: grants, renewals, finished tiles, broken streams, time.
// Keeps in step with each lease: its worker, its job's plan or audits, and the queue. Knows nothing of why a lease
// opens or ends.
#pragma once

#include <set>
#include <span>
#include <unordered_map>

#include "server/domain/farm_totals.h"
#include "server/domain/grants.h"
#include "server/domain/job_queue.h"

namespace lightmill {

class LeaseTable {
 public:
  LeaseTable(const CoordinatorLimits& limits, std::uint64_t epoch, const Grants& grants, WorkerRegistry& workers,
             JobTable& jobs, JobQueue& queue, FarmTotals& totals)
      : limits_(limits),
        epoch_(epoch),
        grants_(grants),
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
  /// Opens a lease of which id, unit and flags are set. The plan or the audits hold its tiles already.
  const Lease& open(Worker& worker, Job& job, Lease lease, Time now);
  /// Sends the grant now, or after the commit that it must not overtake.
  void send_grant(Worker& worker, Job& job, LeaseId id, const Event& event);
  /// The grant waits for a commit. Until it is sent the lease does not expire: a slow store must not make workers look
  /// lost.
  void wait_for_commit(const Worker& worker, Job& job, LeaseId id);
  /// Nothing happens if the grant was sent before.
  void was_sent(LeaseId id, Time now);
  /// Grants among `after_commit` have left.
  void grants_sent(std::span<const LeaseId> leases, Time now);

  /// The lease needs nothing more of this tile. Its last tile ends it.
  void tile_done(LeaseId id, TileId tile, bool by_its_worker, const Event& event);
  /// Ends the holds on what the film covers after this merge, of a result of the lease `from`.
  void settle(Job& job, const NodeKey& merged, LeaseId from, const Event& event);
  /// If the lease audits: it is done with this tile.
  void audit_done(LeaseId id, TileId tile, const Event& event);
  /// A result of the worker came, perhaps for a lease that it had before: its leases that audit the same are done with
  /// this tile.
  void audited_by(const Worker& worker, const NodeKey& key, const Event& event);
  /// The worker will not render this tile of its lease.
  void give_up_tile(LeaseId id, TileId tile, const Event& event);
  struct End {
    bool cancel = false;  ///< tells the worker
    bool lost = false;    ///< counts against the worker
  };
  /// Takes back what remains of a lease.
  void end(LeaseId id, End how, const Event& event);

  void renew(LeaseId id, Time now);
  /// Its worker, which works on its oldest lease first, has sent no result of it for too long.
  bool is_idle(const Lease& lease, Time now) const;
  /// The worker's stream broke: its leases expire after a grace, or earlier.
  void abandon(const Worker& worker, Time now);
  /// The worker came back with the lease.
  void resume(LeaseId id, Time now);
  /// The coordinator stood still: all leases run as long again.
  void extend_all(Time now);
  /// Next lease whose deadline has passed; it stays in the table. Leases of workers that could not be heard are renewed
  /// instead.
  std::optional<LeaseId> expire(Time now);
  std::optional<Time> next_deadline() const;

 private:
  void set_deadline(Lease& lease, Time deadline);
  bool is_oldest(const Lease& lease) const;
  /// Marks the tile done. False if it was so before.
  bool finish_tile(LeaseId id, TileId tile);
  /// Another lease had a tile of this one sooner: its worker is at least as slow as it has been silent.
  void note_silence(Worker& worker, const Lease& lease, Time now) const;

  const CoordinatorLimits& limits_;
  const std::uint64_t epoch_;
  const Grants& grants_;
  WorkerRegistry& workers_;
  JobTable& jobs_;
  JobQueue& queue_;
  FarmTotals& totals_;
  std::uint64_t count_ = 0;
  std::unordered_map<LeaseId, Lease> leases_;
  std::set<std::pair<Time, LeaseId>> expiry_;
};

}  // namespace lightmill
