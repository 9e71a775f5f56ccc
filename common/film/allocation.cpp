#include "common/film/allocation.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Factor of a tile's error when its samples change by 2^shift. Doubling them halves the error, as for random points.
/// Halving them counts fourfold: errors of low-discrepancy points fall faster, up to n^-2 where the picture is smooth.
double error_factor(int shift) {
  return std::ldexp(1.0, shift >= 0 ? -shift : -2 * shift);
}

/// One doubling of a tile's samples. `worth`: reduction of the frame's error over the added cost.
struct Doubling {
  std::size_t tile;
  int from;  ///< shift
  double worth;
};

/// Doublings of all tiles, from the least shift up to `most`, best first. Each doubling of a tile is worth less than
/// the one before. Among equals, tiles with the least shift come first.
std::vector<Doubling> doublings_of(std::span<const TileNoise> tiles, int most) {
  constexpr double kMinCost = 1e-300;  // a tile may cost nothing
  std::vector<Doubling> doublings;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    for (int shift = Allocation::kMinDoublings; shift < most; ++shift) {
      const double gained = tiles[i].variance * (error_factor(shift) - error_factor(shift + 1));
      doublings.push_back({i, shift, gained / std::max(std::ldexp(tiles[i].cost, shift), kMinCost)});
    }
  }
  std::ranges::sort(doublings, {}, [](const Doubling& each) { return std::tuple(-each.worth, each.from, each.tile); });
  return doublings;
}

/// All tiles start with the least shift. The budget is one sample per pixel on average. The best doublings are taken
/// while they fit into it.
std::vector<std::int8_t> one_on_average(std::span<const TileNoise> tiles, int most) {
  std::vector<std::int8_t> shifts(tiles.size(), Allocation::kMinDoublings);
  double left = 0;  // in pixel samples; exact, as multiples of 2^kMinDoublings
  for (const TileNoise& tile : tiles) {
    left += tile.pixels - std::ldexp(tile.pixels, Allocation::kMinDoublings);
  }
  for (const Doubling& doubling : doublings_of(tiles, most)) {
    const double more = std::ldexp(tiles[doubling.tile].pixels, doubling.from);
    if (shifts[doubling.tile] == doubling.from && more <= left) {
      left -= more;
      ++shifts[doubling.tile];
    }
  }
  return shifts;
}

/// relMSE × cost. The tile with the most samples decides the shared cost.
double inefficiency(std::span<const TileNoise> tiles, std::span<const std::int8_t> shifts, double shared_cost) {
  double error = 0, cost = 0;
  int most = Allocation::kMinDoublings;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    error += tiles[i].pixels * tiles[i].variance * error_factor(shifts[i]);
    cost += std::ldexp(tiles[i].pixels * tiles[i].cost, shifts[i]);
    most = std::max(most, int{shifts[i]});
  }
  return error * (cost + std::ldexp(shared_cost, most));
}

}  // namespace

Result<Allocation> Allocation::of(std::vector<std::int8_t> shifts) {
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    if (shifts[i] < kMinDoublings || shifts[i] > kMaxDoublings) {
      return invalid_argument("allocation: tile {} has shift {}, which must be from {} to {}", i, shifts[i],
                              kMinDoublings, kMaxDoublings);
    }
  }
  Allocation out;
  out.shifts_ = std::move(shifts);
  for (const std::int8_t shift : out.shifts_) {
    out.least_shift_ = std::min(out.least_shift_, int{shift});
  }
  return out;
}

AllocationResult allocate(std::span<const TileNoise> tiles, double shared_cost) {
  constexpr double kMinGain = 1.02;
  for (const TileNoise& tile : tiles) {
    LM_CHECK(tile.pixels > 0 && tile.variance >= 0 && tile.cost >= 0);
  }
  AllocationResult best;
  if (std::ranges::none_of(tiles, [](const TileNoise& tile) { return tile.variance > 0; })) {
    return best;
  }
  const double before = inefficiency(tiles, std::vector<std::int8_t>(tiles.size(), 0), shared_cost);
  for (int most = 1; most <= Allocation::kMaxDoublings; ++most) {
    std::vector<std::int8_t> shifts = one_on_average(tiles, most);
    const double gain = before / inefficiency(tiles, shifts, shared_cost);
    if (gain >= kMinGain && gain > best.gain) {
      best = {Allocation::of(std::move(shifts)).value(), gain};
    }
  }
  return best;
}

}  // namespace lightmill
