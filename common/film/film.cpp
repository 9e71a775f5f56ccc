#include "common/film/film.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// The first node of `forest` that ends after sample `first`.
std::size_t first_ending_after(const std::vector<NodePtr>& forest, std::uint64_t first) {
  const auto found = std::partition_point(forest.begin(), forest.end(),
                                          [&](const NodePtr& node) { return node->range.end() <= first; });
  return static_cast<std::size_t>(found - forest.begin());
}

bool same_bits(const Node& a, const Node& b) {
  return a.non_finite == b.non_finite && a.values.size() == b.values.size() &&
         std::memcmp(a.values.data(), b.values.data(), a.values.size() * sizeof(float)) == 0;
}

std::uint64_t value_bytes(const Node& node) {
  return node.values.size() * sizeof(float);
}

}  // namespace

Film::Film(const TileGrid& grid, const NodeLayout& layout, Allocation allocation)
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

bool Film::has_just(std::uint64_t frame_samples) const {
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

const Film::Tile& Film::tile_at(TileId tile) const {
  LM_CHECK(tile.value < tiles_.size(), "tile {} of {}", tile.value, tiles_.size());
  return tiles_[tile.value];
}

MergeOutcome Film::merge(TileId tile, NodePtr node) {
  tile_at(tile);
  LM_CHECK(node->values.size() == expected_values(tile, node->range));
  LM_CHECK(node->range.level <= kMaxRangeLevel && node->range.end() <= kMaxSamples);
  std::vector<NodePtr>& forest = tiles_[tile.value].forest;
  MergeOutcome outcome;

  // Ranges are disjoint or nested: what the new one touches either contains it, or is contained in it.
  std::size_t at = first_ending_after(forest, node->range.first());
  if (at < forest.size() && forest[at]->range.contains(node->range)) {
    const bool differs = forest[at]->range == node->range && !same_bits(*forest[at], *node);
    outcome.kind = differs ? MergeOutcome::Kind::mismatch : MergeOutcome::Kind::duplicate;
    return outcome;
  }
  const std::uint64_t samples_before = tiles_[tile.value].samples;
  std::size_t end = at;
  const auto remove_old = [&](const Node& old) {
    outcome.removed.push_back(old.range);
    tiles_[tile.value].samples -= old.range.count();
    non_finite_ -= old.non_finite;
    bytes_ -= value_bytes(old);
  };
  while (end < forest.size() && node->range.contains(forest[end]->range)) {
    remove_old(*forest[end++]);
  }
  // Join with the sibling, then the parent with its own, as far as they are in.
  for (;;) {
    const SampleRange sibling = node->range.sibling();
    if (at > 0 && forest[at - 1]->range == sibling) {
      remove_old(*forest[--at]);
      node = std::make_shared<const Node>(join(*forest[at], *node, layout_));
    } else if (end < forest.size() && forest[end]->range == sibling) {
      remove_old(*forest[end]);
      node = std::make_shared<const Node>(join(*node, *forest[end++], layout_));
    } else {
      break;
    }
  }
  tiles_[tile.value].samples += node->range.count();
  non_finite_ += node->non_finite;
  bytes_ += value_bytes(*node);
  outcome.added.push_back(node);
  if (at == end) {
    forest.insert(forest.begin() + static_cast<std::ptrdiff_t>(at), std::move(node));
  } else {
    forest[at] = std::move(node);
    forest.erase(forest.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                 forest.begin() + static_cast<std::ptrdiff_t>(end));
  }
  account(tile, samples_before);
  return outcome;
}

void Film::drop(TileId tile, SampleRange range) {
  tile_at(tile);
  std::vector<NodePtr>& forest = tiles_[tile.value].forest;
  const std::size_t at = first_ending_after(forest, range.first());
  LM_CHECK(at < forest.size() && forest[at]->range == range, "tile {} has no node [{}, {})", tile.value, range.first(),
           range.end());
  const std::uint64_t samples_before = tiles_[tile.value].samples;
  tiles_[tile.value].samples -= range.count();
  non_finite_ -= forest[at]->non_finite;
  bytes_ -= value_bytes(*forest[at]);
  forest.erase(forest.begin() + static_cast<std::ptrdiff_t>(at));
  account(tile, samples_before);
}

void Film::restore(TileId tile, NodePtr node) {
  tile_at(tile);
  LM_CHECK(node->values.size() == expected_values(tile, node->range), "a stored node of tile {} has {} values",
           tile.value, node->values.size());
  std::vector<NodePtr>& forest = tiles_[tile.value].forest;
  const std::size_t at = first_ending_after(forest, node->range.first());
  LM_CHECK(at == forest.size() || forest[at]->range.first() >= node->range.end(), "stored nodes of tile {} overlap",
           tile.value);
  const std::uint64_t samples_before = tiles_[tile.value].samples;
  tiles_[tile.value].samples += node->range.count();
  non_finite_ += node->non_finite;
  bytes_ += value_bytes(*node);
  forest.insert(forest.begin() + static_cast<std::ptrdiff_t>(at), std::move(node));
  account(tile, samples_before);
}

void Film::account(TileId tile, std::uint64_t samples_before) {
  const std::uint64_t samples_now = tiles_[tile.value].samples;
  recount(tiles_by_samples_, samples_before, samples_now);
  recount(tiles_by_frame_samples_, allocation_.of_frame(tile, samples_before), allocation_.of_frame(tile, samples_now));
  pixel_samples_ += (samples_now - samples_before) * static_cast<std::uint64_t>(grid_.tile_rect(tile).pixel_count());
  ++tiles_[tile.value].version;
  ++version_;
}

void Film::recount(TilesByCount& tiles, std::uint64_t from, std::uint64_t to) {
  const auto before = tiles.find(from);
  if (--before->second == 0) {
    tiles.erase(before);
  }
  ++tiles[to];
}

std::size_t Film::expected_values(TileId tile, SampleRange range) const {
  return layout_.values(range) * static_cast<std::size_t>(grid_.tile_rect(tile).pixel_count());
}

std::uint64_t Film::samples(TileId tile) const {
  return tile_at(tile).samples;
}

std::uint64_t Film::pixel_samples_at(std::uint64_t frame_samples) const {
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

bool Film::covered(TileId tile, SampleRange range) const {
  const std::vector<NodePtr>& nodes = forest(tile);
  const std::size_t at = first_ending_after(nodes, range.first());
  return at < nodes.size() && nodes[at]->range.contains(range);
}

const std::vector<NodePtr>& Film::forest(TileId tile) const {
  return tile_at(tile).forest;
}

std::vector<float> Film::sums(TileId tile) const {
  return sums_over(forest(tile), layout_, static_cast<std::size_t>(grid_.tile_rect(tile).pixel_count()),
                   layout_.summed);
}

std::vector<float> Film::beauty_sums(TileId tile) const {
  return sums_over(forest(tile), layout_, static_cast<std::size_t>(grid_.tile_rect(tile).pixel_count()),
                   kBeautyChannels);
}

std::vector<float> Film::bias_sums(TileId tile) const {
  return layout_.bias < 0
             ? std::vector<float>()
             : sums_over(forest(tile), layout_, static_cast<std::size_t>(grid_.tile_rect(tile).pixel_count()),
                         kBeautyChannels, static_cast<std::uint32_t>(layout_.bias));
}

Film::HalfCounts Film::half_counts(TileId tile) const {
  HalfCounts counts;
  for (const NodePtr& node : forest(tile)) {
    const SampleRange& range = node->range;
    counts.a += range.level > 0 ? range.count() / 2 : 1 - range.index % 2;
    counts.b += range.level > 0 ? range.count() / 2 : range.index % 2;
  }
  return counts;
}

std::uint64_t Film::version(TileId tile) const {
  return tile_at(tile).version;
}

std::vector<float> sums_over(const std::vector<NodePtr>& forest, const NodeLayout& layout, std::size_t pixels,
                             std::uint32_t channels, std::uint32_t first_channel) {
  LM_CHECK(first_channel + channels <= layout.summed);
  const std::size_t half = channels * pixels;
  std::vector<float> sums(2 * half, 0.0f);
  for (const NodePtr& node : forest) {
    LM_CHECK(node->values.size() == layout.values(node->range) * pixels);
    const float* const a = node->values.data() + first_channel * pixels;
    const float* const b = a + layout.summed * pixels;
    for (std::size_t i = 0; i < half; ++i) {
      sums[i] += a[i];
      sums[half + i] += b[i];
    }
  }
  return sums;
}

FirstValues first_over(const std::vector<NodePtr>& forest, const NodeLayout& layout, std::size_t pixels) {
  FirstValues first;
  for (const NodePtr& node : forest) {
    const std::uint32_t samples = NodeLayout::first_samples_in(node->range);
    if (!layout.has_first() || samples == 0) {
      break;  // the forest is ascending
    }
    LM_CHECK(node->values.size() == layout.values(node->range) * pixels);
    append_first(layout, pixels, first.values, first.samples,
                 std::span(node->values).subspan(layout.summed_values() * pixels), samples);
    first.samples += samples;
  }
  return first;
}

}  // namespace lightmill
