// A simulated disk: what is durable, and nothing else.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "common/film/film.h"
#include "server/domain/effects.h"

namespace lightmill::simulation {

class Disk {
 public:
  /// Applies a transaction of the coordinator of this epoch; one that is not the last's is refused: nothing happens.
  /// Returns what is wrong with what is stored now, if anything: nodes of a tile that overlap, a node that is dropped,
  /// or a result that is verified, without being there.
  std::optional<std::string> apply(std::uint64_t epoch, std::span<const StoreOp> ops);
  std::uint64_t epoch() const { return epoch_; }
  static Sha256 secret() { return sha256("simulation"); }
  /// What a coordinator that starts now gets; takes the next epoch. Of jobs that have ended it has no values.
  StoredState load(bool hide_damage = false);
  /// The nodes of one tile. Damaged ones are left out, and are among `damaged`.
  StoredFilm read_tile(JobId job, TileId tile, bool hide_damage, std::vector<NodeKey>& damaged);
  /// Some bits of the node of this key have changed: it is left out by whoever reads it next.
  void damage(const NodeKey& key) { damaged_.insert(key); }
  /// All nodes of jobs that may go on.
  std::vector<NodeKey> nodes_in_use() const;

  const JobRecord* job(JobId id) const;
  bool covers(const NodeKey& key) const;
  /// Who rendered what of the tile, ascending by first sample.
  struct Result {
    SampleRange range;
    Renderer by;
    bool verified = false;
  };
  std::vector<Result> results(JobId job, TileId tile) const;
  const std::map<std::string, QuarantineRecord>& quarantine() const { return quarantine_; }
  /// Ascending by first sample.
  const std::map<std::uint64_t, NodePtr>& nodes(JobId job, TileId tile) const;

 private:
  /// The node of this key if it is sound. If damage is hidden, also if it is not, and then with a wrong bit.
  NodePtr read(const NodeKey& key, NodePtr& node, bool hide_damage);

  std::map<JobId, JobRecord> jobs_;
  std::map<std::pair<JobId, TileId>, std::map<std::uint64_t, NodePtr>> nodes_;
  std::map<NodeKey, PutResult> results_;
  std::set<NodeKey> verified_;
  std::set<NodeKey> damaged_;
  std::map<std::string, QuarantineRecord> quarantine_;
  std::uint64_t epoch_ = 0;
  std::uint64_t next_job_id_ = 1;
};

}  // namespace lightmill::simulation
