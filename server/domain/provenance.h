// Provenance of the films' nodes: which workers rendered parts of which node.
//
// Owns the list of all renderers, and the parts of each node. Takes merged results, dropped nodes, deleted jobs, and
// stored results.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/film/film.h"
#include "server/domain/event.h"

namespace lightmill {

class Provenance {
 public:
  using Place = std::pair<TileId, SampleRange>;

  /// A stored result was merged into this node of the film.
  void restore(JobId job, TileId tile, SampleRange node, const Renderer& by);
  /// A stored result belongs to no node. The next effects delete its row. Other workers may render the samples now,
  /// also of another class.
  void add_orphan(const NodeKey& key) { orphans_.push_back(key); }
  void forget_orphans(const Event& event);

  void merged(const NodeKey& key, const Renderer& by, const MergeOutcome& outcome);
  void dropped(JobId job, TileId tile, SampleRange node);
  void forget(JobId job) { parts_.erase(job); }

  /// Indices for renderer(), ascending; empty if unknown.
  std::span<const std::uint32_t> parts(const NodeKey& node) const;
  const Renderer& renderer(std::uint32_t index) const { return renderers_.at(index); }
  /// A renderer of this name, or else of this identity.
  std::optional<Renderer> find(const std::string& worker) const;
  /// For each index: whether this renderer shares the quarantine of `faulty`.
  std::vector<bool> sharing_quarantine(const Renderer& faulty) const;
  /// Nodes of the job with parts of these renderers.
  std::vector<Place> nodes_of(JobId job, const std::vector<bool>& renderers) const;

 private:
  std::uint32_t index_of(const Renderer& renderer);

  std::vector<Renderer> renderers_;
  std::map<Renderer, std::uint32_t> indices_;
  std::map<JobId, std::map<Place, std::vector<std::uint32_t>>> parts_;
  std::vector<NodeKey> orphans_;
};

}  // namespace lightmill
