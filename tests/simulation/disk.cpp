#include "tests/simulation/disk.h"

#include <algorithm>
#include <cmath>

namespace lightmill::simulation {

std::optional<std::string> Disk::apply(std::uint64_t epoch, std::span<const StoreOp> ops) {
  if (epoch != epoch_) {
    return std::nullopt;
  }
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
      std::erase_if(results_, [&](const auto& entry) { return entry.first.job == removed->job; });
    } else if (const auto* result = std::get_if<PutResult>(&op)) {
      results_[result->key] = *result;
      audited_.erase(result->key);
    } else if (const auto* audited = std::get_if<PutAudited>(&op)) {
      const auto at = results_.find(audited->key);
      if (at == results_.end()) {
        wrong = fmt::format("a result of tile {} is audited, but not stored", audited->key.tile.value);
      } else {
        at->second.audit_pending = false;
        audited_.insert(audited->key);
      }
    } else if (const auto* dropped = std::get_if<DropResults>(&op)) {
      std::erase_if(results_, [&](const auto& entry) {
        return entry.first.job == dropped->key.job && entry.first.tile == dropped->key.tile &&
               dropped->key.range.contains(entry.first.range);
      });
    } else if (const auto* held = std::get_if<PutQuarantine>(&op)) {
      quarantine_[held->record.of.worker] = held->record;
    } else if (const auto* released = std::get_if<DropQuarantine>(&op)) {
      quarantine_.erase(released->worker);
    } else if (const auto* node = std::get_if<PutNode>(&op)) {
      std::map<std::uint64_t, NodePtr>& tile = nodes_[{node->job, node->tile}];
      if (const auto at = tile.find(node->node->range.first()); at != tile.end()) {
        wrong = fmt::format("two nodes of tile {} begin with sample {}", node->tile.value, at->first);
      }
      tile[node->node->range.first()] = std::make_shared<const Node>(*node->node);  // memory and disk share no data
      damaged_.erase({node->job, node->tile, node->node->range});
      touched.insert({node->job, node->tile});
    } else if (const auto* drop = std::get_if<DropNode>(&op)) {
      std::map<std::uint64_t, NodePtr>& tile = nodes_[{drop->key.job, drop->key.tile}];
      const auto at = tile.find(drop->key.range.first());
      if (at == tile.end() || at->second->range != drop->key.range) {
        wrong = fmt::format("a node of tile {} is dropped, but not stored", drop->key.tile.value);
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

NodePtr Disk::read(const NodeKey& key, NodePtr& node, bool hide_damage) {
  if (damaged_.contains(key)) {
    if (!hide_damage) {
      return nullptr;
    }
    damaged_.erase(key);
    Node wrong = *node;
    wrong.values[0] = std::nextafter(wrong.values[0], 1e30f);
    node = std::make_shared<const Node>(std::move(wrong));
  }
  return std::make_shared<const Node>(*node);
}

StoredFilm Disk::read_tile(JobId job, TileId tile, bool hide_damage, std::vector<NodeKey>& damaged) {
  StoredFilm film;
  for (auto& [first, node] : nodes_[{job, tile}]) {
    const NodeKey key{job, tile, node->range};
    if (NodePtr sound = read(key, node, hide_damage)) {
      film.emplace_back(tile, std::move(sound));
    } else {
      damaged.push_back(key);
    }
  }
  return film;
}

StoredState Disk::load(bool hide_damage) {
  StoredState state;
  state.epoch = ++epoch_;
  state.next_job_id = next_job_id_;
  state.secret = secret_;
  for (const auto& [worker, record] : quarantine_) {
    state.quarantine.push_back(record);
  }
  for (const auto& [id, record] : jobs_) {
    StoredState::StoredJob& job = state.jobs.emplace_back(StoredState::StoredJob{record, {}});
    for (auto& [key, nodes] : nodes_) {
      if (key.first == id && has_ended(record.state)) {
        for (const auto& [first, node] : nodes) {
          job.nodes.emplace_back(key.second, outline_of(*node));
        }
      } else if (key.first == id) {
        std::ranges::move(read_tile(id, key.second, hide_damage, state.damaged), std::back_inserter(job.nodes));
      }
    }
    for (const auto& [key, result] : results_) {
      if (key.job == id) {
        job.results.push_back({key.tile, key.range, result.hash, static_cast<std::uint32_t>(state.renderers.size()),
                               result.audit_pending});
        state.renderers.push_back(result.by);
      }
    }
  }
  for (const NodeKey& key : state.damaged) {
    nodes_[{key.job, key.tile}].erase(key.range.first());
    damaged_.erase(key);
  }
  return state;
}

std::vector<NodeKey> Disk::nodes_in_use() const {
  std::vector<NodeKey> keys;
  for (const auto& [place, tile] : nodes_) {
    const JobRecord* const record = job(place.first);
    if (record == nullptr || record->state == JobState::cancelled || record->state == JobState::failed) {
      continue;
    }
    for (const auto& [first, node] : tile) {
      keys.push_back({place.first, place.second, node->range});
    }
  }
  return keys;
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

std::vector<Disk::Result> Disk::results(JobId job, TileId tile) const {
  std::vector<Result> found;
  for (auto at = results_.lower_bound({job, tile, {}});
       at != results_.end() && at->first.job == job && at->first.tile == tile; ++at) {
    found.push_back({at->first.range, at->second.by, audited_.contains(at->first)});
  }
  std::ranges::sort(found, {}, [](const Result& result) { return result.range.first(); });
  return found;
}

bool Disk::covers(const NodeKey& key) const {
  const std::map<std::uint64_t, NodePtr>& tile = nodes(key.job, key.tile);
  auto after = tile.upper_bound(key.range.first());
  return after != tile.begin() && (--after)->second->range.contains(key.range);
}

}  // namespace lightmill::simulation
