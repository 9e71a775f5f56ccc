#include "common/planner/tile_noise.h"

#include <algorithm>

#include "common/math/rel_mse.h"
#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/counted_cost.h"

namespace lightmill {
namespace {

constexpr int kNoisePatchSide = 2;        ///< pixels
constexpr int kMinCellSide = 8;           ///< pixels; so that no edge lies between patches
constexpr std::uint32_t kNoiseLevel = 4;  ///< log2 of the samples
/// After the first points of a sequence, where most samples of an adaptive job are.
constexpr std::uint32_t kFirst = 64;
constexpr std::uint64_t kNoiseSeed = 0xc2b2ae3d27d4eb4fu;  ///< any constant

struct PatchSums {
  std::vector<double> values;  ///< half A, then half B, as RGB planes
  CountedCost cost;
};

/// The sums over all samples of each patch.
Result<std::vector<PatchSums>> sample(const Method& method, const MethodSpec& spec, std::span<const PixelRect> patches,
                                      const std::stop_token& stop) {
  const std::uint32_t level = level_at_a_time(spec, kNoiseLevel);
  const std::unique_ptr<Workspace> workspace = method.make_workspace();
  workspace->stop = stop;
  std::vector<PatchSums> all(patches.size());
  for (std::uint32_t piece = 0; piece < 1u << (kNoiseLevel - level); ++piece) {
    for (std::size_t i = 0; i < patches.size(); ++i) {
      workspace->counters = {};
      const Node node = method.render(patches[i], {level, (kFirst >> level) + piece}, *workspace);
      if (stop.stop_requested()) {
        return cancelled("the pilot was stopped");
      }
      all[i].values.resize(node.values.size());
      for (std::size_t v = 0; v < node.values.size(); ++v) {
        all[i].values[v] += static_cast<double>(node.values[v]);
      }
      const CountedCost cost = cost_of(workspace->counters);
      all[i].cost.own += cost.own;
      all[i].cost.shared += cost.shared;
    }
  }
  return all;
}

/// (A − B)²/4 is the variance of the mean of all samples. A·B, if positive, estimates r².
double variance_of(const PatchSums& sums) {
  constexpr double kCount = 1u << kNoiseLevel;
  const std::size_t half = sums.values.size() / 2;
  double sum = 0;
  for (std::size_t i = 0; i < half; ++i) {
    const double a = sums.values[i] / (kCount / 2), b = sums.values[half + i] / (kCount / 2);
    sum += (a - b) * (a - b) / 4 * kCount / (std::max(a * b, 0.0) + kRelMseFloor);
  }
  return sum / static_cast<double>(half);
}

}  // namespace

int noise_cell_side(const PixelRect& film, std::int64_t most_pixels) {
  int side = kMinCellSide;
  while (film.pixel_count() * kNoisePatchSide * kNoisePatchSide > most_pixels * side * side) {
    side *= 2;
  }
  return side;
}

std::vector<PixelRect> noise_patches(const PixelRect& tile, int cell_side) {
  std::vector<PixelRect> patches;
  for (int y = 0; y < tile.height; y += cell_side) {
    const int height = std::min(cell_side, tile.height - y), high = std::min(height, kNoisePatchSide);
    for (int x = 0; x < tile.width; x += cell_side) {
      const int width = std::min(cell_side, tile.width - x), wide = std::min(width, kNoisePatchSide);
      patches.push_back({tile.x + x + (width - wide) / 2, tile.y + y + (height - high) / 2, wide, high});
    }
  }
  return patches;
}

Result<AllocationResult> find_allocation(const std::shared_ptr<const CompiledScene>& scene,
                                         const TileNoiseSettings& settings, const std::stop_token& stop) {
  LM_ASSIGN_OR_RETURN(const MethodSpec spec, parse_method(settings.method));
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<Method> method,
                      make_method(scene, {settings.method, settings.seed ^ kNoiseSeed, settings.max_bounces}));
  constexpr double kCount = 1u << kNoiseLevel;
  const TileGrid& grid = settings.grid;
  const int cell_side = noise_cell_side(grid.crop(), settings.most_pixels);
  const auto region_of = [&, across = cell_side / kMinCellSide](std::uint32_t tile) {
    const auto columns = static_cast<std::uint32_t>(grid.columns()), side = static_cast<std::uint32_t>(across);
    return std::size_t{tile / columns / side} * columns + tile % columns / side;
  };
  std::vector<PixelRect> patches;
  std::vector<std::size_t> regions;  // by patch
  const std::uint32_t tiles = grid.picture_tiles();
  for (std::uint32_t tile = 0; tile < tiles; ++tile) {
    for (const PixelRect& patch : noise_patches(grid.tile_rect(TileId{tile}), cell_side)) {
      patches.push_back(patch);
      regions.push_back(region_of(tile));
    }
  }
  LM_ASSIGN_OR_RETURN(const std::vector<PatchSums> sums, sample(*method, spec, patches, stop));
  std::vector<TileNoise> seen(tiles);  // by region, summed over pixels
  double shared_cost = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto pixels = static_cast<double>(patches[i].pixel_count());
    TileNoise& of = seen[regions[i]];
    of.pixels += pixels;
    of.variance += pixels * variance_of(sums[i]);
    of.cost += sums[i].cost.own / kCount;
    shared_cost += sums[i].cost.shared / kCount;
  }
  std::vector<TileNoise> noise;
  for (std::uint32_t tile = 0; tile < tiles; ++tile) {
    const TileNoise& region = seen[region_of(tile)];
    noise.push_back({static_cast<double>(grid.tile_rect(TileId{tile}).pixel_count()), region.variance / region.pixels,
                     region.cost / region.pixels});
  }
  AllocationResult result = allocate(noise, shared_cost);
  if (!result.allocation.even()) {
    std::vector<std::int8_t> shifts(result.allocation.shifts().begin(), result.allocation.shifts().end());
    shifts.resize(settings.grid.tile_count(), 0);
    LM_ASSIGN_OR_RETURN(result.allocation, Allocation::of(std::move(shifts)));
  }
  return result;
}

std::string describe(const AllocationResult& result) {
  if (result.allocation.even()) {
    return "all tiles get the same number of samples: a pilot found little gain from more samples for noisy tiles";
  }
  const auto [least, most] = std::ranges::minmax(result.allocation.shifts());
  return fmt::format(
      "tiles get {:g} to {:g} times the mean number of samples, by their noise: a pilot predicts {:.3g} times less "
      "work for equal error",
      std::ldexp(1.0, least), std::ldexp(1.0, most), result.gain);
}

}  // namespace lightmill
