#include "common/film/film_outline.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {

NodeOutline outline_of(const Node& node) {
  return {node.range, node.non_finite, node.values.size()};
}

FilmOutline::FilmOutline(const TileGrid& grid, const NodeLayout& layout, Allocation allocation)
    : grid_(grid),
      layout_(layout),
      allocation_(std::move(allocation)),
      tiles_(grid.tile_count()),
      tiles_by_samples_{{0, grid.tile_count()}},
      tiles_by_frame_samples_{{0, grid.tile_count()}} {
  LM_CHECK(grid.tile_count() > 0 && layout.summed > 0);
  if (!allocation_.even()) {
    double sum = 0;
    for (std::uint32_t tile = 0; tile < grid.tile_count(); ++tile) {
      sum +=
          std::ldexp(static_cast<double>(grid.tile_rect(TileId{tile}).pixel_count()), allocation_.shift(TileId{tile}));
    }
    mean_share_ = sum / static_cast<double>(grid.pixel_count());
  }
}

bool FilmOutline::has_exactly(std::uint64_t frame_samples) const {
  if (this->frame_samples() != frame_samples) {
    return false;
  }
  for (std::uint32_t tile = 0; tile < grid_.tile_count(); ++tile) {
    if (tiles_[tile].samples != allocation_.of_tile(TileId{tile}, frame_samples)) {
      return false;
    }
  }
  return true;
}

const FilmOutline::Tile& FilmOutline::tile_at(TileId tile) const {
  LM_CHECK(tile.value < tiles_.size(), "tile {} of {}", tile.value, tiles_.size());
  return tiles_[tile.value];
}

std::size_t FilmOutline::first_ending_after(TileId tile, std::uint64_t first) const {
  const std::vector<NodeOutline>& nodes = tile_at(tile).nodes;
  const auto found = std::partition_point(nodes.begin(), nodes.end(),
                                          [&](const NodeOutline& node) { return node.range.end() <= first; });
  return static_cast<std::size_t>(found - nodes.begin());
}

void FilmOutline::count(Tile& tile, const NodeOutline& node, bool added) {
  const auto add = [added](std::uint64_t& sum, std::uint64_t value) { sum = added ? sum + value : sum - value; };
  add(tile.samples, node.range.count());
  add(non_finite_, node.non_finite);
  add(bytes_, node.values * sizeof(float));
}

void FilmOutline::replace(TileId id, std::size_t begin, std::size_t end, const NodeOutline& node) {
  Tile& tile = tiles_[id.value];
  const std::uint64_t samples_before = tile.samples;
  for (std::size_t i = begin; i < end; ++i) {
    count(tile, tile.nodes[i], false);
  }
  count(tile, node, true);
  const auto at = tile.nodes.begin() + static_cast<std::ptrdiff_t>(begin);
  tile.nodes.insert(tile.nodes.erase(at, at + static_cast<std::ptrdiff_t>(end - begin)), node);
  account(id, samples_before);
}

void FilmOutline::drop(TileId id, SampleRange range) {
  const std::size_t at = first_ending_after(id, range.first());
  Tile& tile = tiles_[id.value];
  LM_CHECK(at < tile.nodes.size() && tile.nodes[at].range == range, "tile {} has no node [{}, {})", id.value,
           range.first(), range.end());
  const std::uint64_t samples_before = tile.samples;
  count(tile, tile.nodes[at], false);
  tile.nodes.erase(tile.nodes.begin() + static_cast<std::ptrdiff_t>(at));
  account(id, samples_before);
}

void FilmOutline::restore(TileId tile, const NodeOutline& node) {
  LM_CHECK(node.values == expected_values(tile, node.range), "a stored node of tile {} has {} values", tile.value,
           node.values);
  const std::size_t at = first_ending_after(tile, node.range.first());
  const std::vector<NodeOutline>& nodes = tile_at(tile).nodes;
  LM_CHECK(at == nodes.size() || nodes[at].range.first() >= node.range.end(), "stored nodes of tile {} overlap",
           tile.value);
  replace(tile, at, at, node);
}

void FilmOutline::account(TileId tile, std::uint64_t samples_before) {
  const std::uint64_t samples_now = tiles_[tile.value].samples;
  recount(tiles_by_samples_, samples_before, samples_now);
  recount(tiles_by_frame_samples_, allocation_.of_frame(tile, samples_before), allocation_.of_frame(tile, samples_now));
  pixel_samples_ += (samples_now - samples_before) * static_cast<std::uint64_t>(grid_.tile_rect(tile).pixel_count());
  ++tiles_[tile.value].version;
  ++version_;
}

void FilmOutline::recount(TilesByCount& tiles, std::uint64_t from, std::uint64_t to) {
  const auto before = tiles.find(from);
  if (--before->second == 0) {
    tiles.erase(before);
  }
  ++tiles[to];
}

std::size_t FilmOutline::expected_values(TileId tile, SampleRange range) const {
  return layout_.values(range) * static_cast<std::size_t>(grid_.tile_rect(tile).pixel_count());
}

std::uint64_t FilmOutline::samples(TileId tile) const {
  return tile_at(tile).samples;
}

std::uint64_t FilmOutline::pixel_samples_at(std::uint64_t frame_samples) const {
  if (allocation_.even()) {
    return frame_samples * grid_.pixel_count();
  }
  std::uint64_t sum = 0;
  for (std::uint32_t tile = 0; tile < grid_.tile_count(); ++tile) {
    sum += allocation_.of_tile(TileId{tile}, frame_samples) *
           static_cast<std::uint64_t>(grid_.tile_rect(TileId{tile}).pixel_count());
  }
  return sum;
}

const NodeOutline* FilmOutline::find(TileId tile, SampleRange range) const {
  const std::size_t at = first_ending_after(tile, range.first());
  const std::vector<NodeOutline>& nodes = tile_at(tile).nodes;
  return at < nodes.size() && nodes[at].range.contains(range) ? &nodes[at] : nullptr;
}

bool FilmOutline::covered(TileId tile, SampleRange range) const {
  return find(tile, range) != nullptr;
}

const std::vector<NodeOutline>& FilmOutline::nodes(TileId tile) const {
  return tile_at(tile).nodes;
}

FilmOutline::HalfCounts FilmOutline::half_counts(TileId tile) const {
  HalfCounts counts;
  for (const NodeOutline& node : nodes(tile)) {
    const SampleRange& range = node.range;
    counts.a += range.level > 0 ? range.count() / 2 : 1 - range.index % 2;
    counts.b += range.level > 0 ? range.count() / 2 : range.index % 2;
  }
  return counts;
}

std::uint64_t FilmOutline::version(TileId tile) const {
  return tile_at(tile).version;
}

}  // namespace lightmill
