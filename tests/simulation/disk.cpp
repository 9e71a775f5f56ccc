#include "tests/simulation/disk.h"

namespace lightmill::simulation {

std::optional<std::string> Disk::apply(std::span<const StoreOp> ops) {
  std::optional<std::string> wrong;
  std::set<std::pair<JobId, TileId>> touched;
  for (const StoreOp& op : ops) {
    if (const auto* put = std::get_if<PutJob>(&op)) {
      jobs_[put->record.id] = put->record;
      next_job_id_ = std::max(next_job_id_, put->record.id.value + 1);
    } else if (const auto* progress = std::get_if<PutProgress>(&op)) {
      const auto job = jobs_.find(progress->job);
      if (job == jobs_.end()) {
        wrong = fmt::format("progress of job {}, which is not stored", progress->job.value);
        continue;
      }
      job->second.active_seconds = progress->active_seconds;
      job->second.worker_seconds = progress->worker_seconds;
      job->second.counters = progress->counters;
    } else if (const auto* removed = std::get_if<DeleteJobRows>(&op)) {
      jobs_.erase(removed->job);
      std::erase_if(nodes_, [&](const auto& entry) { return entry.first.first == removed->job; });
    } else if (const auto* node = std::get_if<PutNode>(&op)) {
      std::map<std::uint64_t, NodePtr>& tile = nodes_[{node->job, node->tile}];
      if (const auto at = tile.find(node->node->range.first()); at != tile.end()) {
        wrong = fmt::format("two nodes of tile {} begin with sample {}", node->tile.value, at->first);
      }
      tile[node->node->range.first()] = node->node;
      touched.insert({node->job, node->tile});
    } else if (const auto* drop = std::get_if<DropNode>(&op)) {
      std::map<std::uint64_t, NodePtr>& tile = nodes_[{drop->key.job, drop->key.tile}];
      const auto at = tile.find(drop->key.range.first());
      if (at == tile.end() || at->second->range != drop->key.range) {
        wrong = fmt::format("a node of tile {} is dropped that is not stored", drop->key.tile.value);
      } else {
        tile.erase(at);
      }
    }
  }
  for (const auto& key : touched) {
    std::uint64_t end = 0;
    for (const auto& [first, node] : nodes_[key]) {
      if (first < end) {
        wrong =
            fmt::format("job {}, tile {}: stored nodes overlap at sample {}", key.first.value, key.second.value, first);
      }
      end = node->range.end();
    }
  }
  return wrong;
}

StoredState Disk::load() {
  StoredState state;
  state.epoch = ++epoch_;
  state.next_job_id = next_job_id_;
  for (const auto& [id, record] : jobs_) {
    state.jobs.push_back({record, {}});
    for (const auto& [key, nodes] : nodes_) {
      if (key.first == id) {
        for (const auto& [first, node] : nodes) {
          state.jobs.back().nodes.push_back({key.second, node});
        }
      }
    }
  }
  return state;
}

const JobRecord* Disk::job(JobId id) const {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : &found->second;
}

const std::map<std::uint64_t, NodePtr>& Disk::nodes(JobId job, TileId tile) const {
  static const std::map<std::uint64_t, NodePtr> kNone;
  const auto found = nodes_.find({job, tile});
  return found == nodes_.end() ? kNone : found->second;
}

bool Disk::covers(const NodeKey& key) const {
  const std::map<std::uint64_t, NodePtr>& tile = nodes(key.job, key.tile);
  auto after = tile.upper_bound(key.range.first());
  return after != tile.begin() && (--after)->second->range.contains(key.range);
}

}  // namespace lightmill::simulation
