#include "server/domain/provenance.h"

#include <algorithm>

#include "server/domain/quarantine_list.h"

namespace lightmill {

std::uint32_t Provenance::index_of(const Renderer& renderer) {
  const auto [at, fresh] = indices_.try_emplace(renderer, static_cast<std::uint32_t>(renderers_.size()));
  if (fresh) {
    renderers_.push_back(renderer);
  }
  return at->second;
}

void Provenance::restore(JobId job, TileId tile, SampleRange node, const Renderer& by) {
  std::vector<std::uint32_t>& parts = parts_[job][{tile, node}];
  const std::uint32_t index = index_of(by);
  if (const auto at = std::ranges::lower_bound(parts, index); at == parts.end() || *at != index) {
    parts.insert(at, index);
  }
}

void Provenance::forget_orphans(const Event& event) {
  for (const NodeKey& key : std::exchange(orphans_, {})) {
    event.store(DropResults{key});
  }
}

void Provenance::merged(const NodeKey& key, const Renderer& by, const MergeOutcome& outcome) {
  auto& of_job = parts_[key.job];
  std::vector<std::uint32_t> parts{index_of(by)};
  for (const SampleRange& range : outcome.removed) {
    const auto found = of_job.find({key.tile, range});
    if (found == of_job.end()) {
      continue;
    }
    if (!key.range.contains(range)) {  // joined, not replaced
      parts.insert(parts.end(), found->second.begin(), found->second.end());
    }
    of_job.erase(found);
  }
  std::ranges::sort(parts);
  parts.erase(std::unique(parts.begin(), parts.end()), parts.end());
  for (const NodePtr& node : outcome.added) {
    of_job[{key.tile, node->range}] = parts;
  }
}

void Provenance::dropped(JobId job, TileId tile, SampleRange node) {
  if (const auto found = parts_.find(job); found != parts_.end()) {
    found->second.erase({tile, node});
  }
}

std::span<const std::uint32_t> Provenance::parts(const NodeKey& node) const {
  if (const auto of_job = parts_.find(node.job); of_job != parts_.end()) {
    if (const auto found = of_job->second.find({node.tile, node.range}); found != of_job->second.end()) {
      return found->second;
    }
  }
  return {};
}

std::optional<Renderer> Provenance::find(const std::string& worker) const {
  auto found = std::ranges::find(renderers_, worker, &Renderer::worker);
  if (found == renderers_.end()) {
    found = std::ranges::find(renderers_, worker, &Renderer::identity);
  }
  return found == renderers_.end() ? std::nullopt : std::optional(*found);
}

std::vector<bool> Provenance::sharing_quarantine(const Renderer& faulty) const {
  std::vector<bool> found;
  for (const Renderer& each : renderers_) {
    found.push_back(shares_quarantine(faulty, each));
  }
  return found;
}

std::vector<Provenance::Place> Provenance::nodes_of(JobId job, const std::vector<bool>& renderers) const {
  std::vector<Place> nodes;
  if (const auto of_job = parts_.find(job); of_job != parts_.end()) {
    for (const auto& [place, parts] : of_job->second) {
      if (std::ranges::any_of(parts, [&](std::uint32_t part) { return renderers[part]; })) {
        nodes.push_back(place);
      }
    }
  }
  return nodes;
}

}  // namespace lightmill
