#include "server/store/coalesce.h"

namespace lightmill {

std::vector<StoreOp> coalesce(std::vector<StoreOp> ops) {
  std::vector<bool> keep(ops.size(), true);
  std::map<NodeKey, std::size_t> put_nodes;  // nodes put here and not dropped yet
  std::map<JobId, std::size_t> first_row;    // where the job's row is first written: what refers to it comes after
  std::map<JobId, std::size_t> progress;     // where its progress was last written
  for (std::size_t i = 0; i < ops.size(); ++i) {
    if (auto* put = std::get_if<PutJob>(&ops[i])) {
      const JobId job = put->record.id;
      if (const auto at = progress.find(job); at != progress.end()) {
        keep[at->second] = false;
        progress.erase(at);
      }
      const auto [at, first] = first_row.emplace(job, i);
      if (!first) {
        std::get<PutJob>(ops[at->second]).record = std::move(put->record);
        keep[i] = false;
      }
    } else if (const auto* step = std::get_if<PutProgress>(&ops[i])) {
      if (const auto [at, first] = progress.emplace(step->job, i); !first) {
        keep[at->second] = false;
        at->second = i;
      }
    } else if (const auto* removed = std::get_if<DeleteJobRows>(&ops[i])) {
      first_row.erase(removed->job);
      progress.erase(removed->job);
      std::erase_if(put_nodes, [&](const auto& entry) { return entry.first.job == removed->job; });
    } else if (const auto* node = std::get_if<PutNode>(&ops[i])) {
      put_nodes[NodeKey{node->job, node->tile, node->node->range}] = i;
    } else if (const auto* drop = std::get_if<DropNode>(&ops[i])) {
      if (const auto at = put_nodes.find(drop->key); at != put_nodes.end()) {
        // A row of an earlier transaction may stand under the same key, so the drop itself stays.
        keep[at->second] = false;
        put_nodes.erase(at);
      }
    }
  }
  std::vector<StoreOp> kept;
  kept.reserve(ops.size());
  for (std::size_t i = 0; i < ops.size(); ++i) {
    if (keep[i]) {
      kept.push_back(std::move(ops[i]));
    }
  }
  return kept;
}

}  // namespace lightmill
