// A simulated disk: what is durable, and nothing else.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "common/film/film.h"
#include "server/domain/effects.h"

namespace lightmill::simulation {

class Disk {
 public:
  /// Applies a transaction. Returns what is wrong with what is stored now, if anything: nodes of a tile that overlap, a
  /// node that is dropped without being there.
  std::optional<std::string> apply(std::span<const StoreOp> ops);
  /// What a coordinator that starts now gets; takes the next epoch.
  StoredState load();

  const JobRecord* job(JobId id) const;
  bool covers(const NodeKey& key) const;
  /// Ascending by first sample.
  const std::map<std::uint64_t, NodePtr>& nodes(JobId job, TileId tile) const;

 private:
  std::map<JobId, JobRecord> jobs_;
  std::map<std::pair<JobId, TileId>, std::map<std::uint64_t, NodePtr>> nodes_;
  std::uint64_t epoch_ = 0;
  std::uint64_t next_job_id_ = 1;
};

}  // namespace lightmill::simulation
