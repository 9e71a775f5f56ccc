#include "server/store/coalesce.h"

namespace lightmill {

std::vector<StoreOp> coalesce(std::vector<StoreOp> ops) {
  std::vector<bool> keep(ops.size(), true);
  std::map<NodeKey, std::size_t> put_nodes;  // put in this transaction, and not dropped yet
  std::map<JobId, std::size_t> first_row;    // first write of the job's row: writes that refer to it come later
  std::map<JobId, std::size_t> progress;     // last write of the job's progress
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
        // The drop stays, because an earlier transaction may have stored a row with this key.
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
