#include "common/film/film.h"

#include <algorithm>
#include <cstring>

#include "common/base/check.h"

namespace lightmill {
namespace {

bool same_bits(const Node& a, const Node& b) {
  return a.non_finite == b.non_finite && a.values.size() == b.values.size() &&
         std::memcmp(a.values.data(), b.values.data(), a.values.size() * sizeof(float)) == 0;
}

}  // namespace

Film::Film(const TileGrid& grid, const NodeLayout& layout, Allocation allocation)
    : FilmOutline(grid, layout, std::move(allocation)), forests_(grid.tile_count()) {}

Film::Film(FilmOutline outline, std::vector<std::vector<NodePtr>> nodes)
    : FilmOutline(std::move(outline)), forests_(std::move(nodes)) {
  LM_CHECK(forests_.size() == grid().tile_count());
  for (std::uint32_t tile = 0; tile < forests_.size(); ++tile) {
    LM_CHECK(std::ranges::equal(forests_[tile], FilmOutline::nodes(TileId{tile}), {},
                                [](const NodePtr& node) { return outline_of(*node); }),
             "tile {} has other nodes than its outline", tile);
  }
}

MergeOutcome Film::merge(TileId tile, NodePtr node) {
  LM_CHECK(node->values.size() == expected_values(tile, node->range));
  LM_CHECK(node->range.level <= kMaxRangeLevel && node->range.end() <= kMaxSamples);
  // Ranges are disjoint or nested, so a node that overlaps the new one contains it, or is contained in it.
  std::size_t at = first_ending_after(tile, node->range.first());
  std::vector<NodePtr>& forest = forests_[tile.value];
  MergeOutcome outcome;
  if (at < forest.size() && forest[at]->range.contains(node->range)) {
    const bool differs = forest[at]->range == node->range && !same_bits(*forest[at], *node);
    outcome.kind = differs ? MergeOutcome::Kind::mismatch : MergeOutcome::Kind::duplicate;
    return outcome;
  }
  std::size_t end = at;
  while (end < forest.size() && node->range.contains(forest[end]->range)) {
    outcome.removed.push_back(forest[end++]->range);
  }
  // Join with the sibling, then the parent with its sibling, while they are in the forest.
  for (;;) {
    const SampleRange sibling = node->range.sibling();
    if (at > 0 && forest[at - 1]->range == sibling) {
      node = std::make_shared<const Node>(join(*forest[--at], *node, layout()));
    } else if (end < forest.size() && forest[end]->range == sibling) {
      node = std::make_shared<const Node>(join(*node, *forest[end++], layout()));
    } else {
      break;
    }
    outcome.removed.push_back(sibling);
  }
  replace(tile, at, end, outline_of(*node));
  outcome.added.push_back(node);
  if (at == end) {
    forest.insert(forest.begin() + static_cast<std::ptrdiff_t>(at), std::move(node));
  } else {
    forest[at] = std::move(node);
    forest.erase(forest.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                 forest.begin() + static_cast<std::ptrdiff_t>(end));
  }
  return outcome;
}

void Film::drop(TileId tile, SampleRange range) {
  FilmOutline::drop(tile, range);
  std::erase_if(forests_[tile.value], [&](const NodePtr& node) { return node->range == range; });
}

void Film::restore(TileId tile, NodePtr node) {
  FilmOutline::restore(tile, outline_of(*node));
  std::vector<NodePtr>& forest = forests_[tile.value];
  forest.insert(forest.begin() + static_cast<std::ptrdiff_t>(first_ending_after(tile, node->range.first())),
                std::move(node));
}

const std::vector<NodePtr>& Film::forest(TileId tile) const {
  LM_CHECK(tile.value < forests_.size(), "tile {} of {}", tile.value, forests_.size());
  return forests_[tile.value];
}

bool Film::shared() const {
  return std::ranges::any_of(forests_, [](const std::vector<NodePtr>& forest) {
    return std::ranges::any_of(forest, [](const NodePtr& node) { return node.use_count() > 1; });
  });
}

std::vector<float> Film::beauty_sums(TileId tile) const {
  return sums_over(forest(tile), layout(), static_cast<std::size_t>(grid().tile_rect(tile).pixel_count()),
                   kBeautyChannels);
}

std::vector<float> Film::bias_sums(TileId tile) const {
  return layout().bias < 0
             ? std::vector<float>()
             : sums_over(forest(tile), layout(), static_cast<std::size_t>(grid().tile_rect(tile).pixel_count()),
                         kBeautyChannels, static_cast<std::uint32_t>(layout().bias));
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
