// Simulated disk: it has only what is durable.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "common/film/film.h"
#include "server/domain/stored_rows.h"

namespace lightmill::simulation {

class Disk {
 public:
  /// Applies a transaction of the coordinator of this epoch. Ignores it if the epoch is not the last one. Returns an
  /// error, if any: overlapping nodes of a tile, or a dropped node or audited result that is not stored.
  std::optional<std::string> apply(std::uint64_t epoch, std::span<const StoreOp> ops);
  std::uint64_t epoch() const { return epoch_; }
  const Sha256& secret() const { return secret_; }
  void set_secret(const Sha256& secret) { secret_ = secret; }
  /// State for a coordinator that starts now, with the next epoch. It has no values for ended jobs.
  StoredState load(bool hide_damage = false);
  /// Nodes of one tile. Damaged ones are left out, and added to `damaged`.
  StoredFilm read_tile(JobId job, TileId tile, bool hide_damage, std::vector<NodeKey>& damaged);
  /// Some bits of this node have changed. The next read leaves it out.
  void damage(const NodeKey& key) { damaged_.insert(key); }
  /// All nodes of jobs that may continue.
  std::vector<NodeKey> nodes_in_use() const;

  const JobRecord* job(JobId id) const;
  bool covers(const NodeKey& key) const;
  /// Recorded results of the tile, ascending by first sample.
  struct Result {
    SampleRange range;
    Renderer by;
    bool audited = false;
  };
  std::vector<Result> results(JobId job, TileId tile) const;
  const std::map<std::string, QuarantineRecord>& quarantine() const { return quarantine_; }
  /// Ascending by first sample.
  const std::map<std::uint64_t, NodePtr>& nodes(JobId job, TileId tile) const;

 private:
  /// The node of this key if it is undamaged. If damage is hidden, a damaged one too, with a wrong bit.
  NodePtr read(const NodeKey& key, NodePtr& node, bool hide_damage);

  Sha256 secret_ = sha256("simulation");
  std::map<JobId, JobRecord> jobs_;
  std::map<std::pair<JobId, TileId>, std::map<std::uint64_t, NodePtr>> nodes_;
  std::map<NodeKey, PutResult> results_;
  std::set<NodeKey> audited_;
  std::set<NodeKey> damaged_;
  std::map<std::string, QuarantineRecord> quarantine_;
  std::uint64_t epoch_ = 0;
  std::uint64_t next_job_id_ = 1;
};

}  // namespace lightmill::simulation
