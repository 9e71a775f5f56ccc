#include "common/film/allocation.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// What a tile's error becomes by its shift. More samples bring at least what random ones would. Fewer may cost more
/// than that: errors of points that fill space evenly fall faster than 1/n, up to n^-2 where the picture is smooth.
double error_factor(int shift) {
  return std::ldexp(1.0, shift >= 0 ? -shift : -2 * shift);
}

/// The shift of least error and cost, if cost has this weight; none, where others are no better.
std::int8_t best_shift(const TileNoise& tile, double weight, int most) {
  const auto price = [&](int shift) {
    return tile.variance * error_factor(shift) + weight * std::ldexp(tile.cost, shift);
  };
  int best = 0;
  for (int shift = Allocation::kLeastShift; shift <= most; ++shift) {
    best = price(shift) < price(best) ? shift : best;
  }
  return static_cast<std::int8_t>(best);
}

std::vector<std::int8_t> shifts_of(std::span<const TileNoise> tiles, double weight, int most) {
  std::vector<std::int8_t> shifts;
  for (const TileNoise& tile : tiles) {
    shifts.push_back(best_shift(tile, weight, most));
  }
  return shifts;
}

double mean_share(std::span<const TileNoise> tiles, std::span<const std::int8_t> shifts) {
  double sum = 0, pixels = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    sum += std::ldexp(tiles[i].pixels, shifts[i]);
    pixels += tiles[i].pixels;
  }
  return sum / pixels;
}

/// The least weight of cost, within rounding, at which tiles have no more than one sample on average.
std::vector<std::int8_t> at_most_one(std::span<const TileNoise> tiles, int most) {
  double low = 0x1p-100, high = 0x1p100;
  for (int step = 0; step < 100; ++step) {
    const double middle = std::sqrt(low * high);
    (mean_share(tiles, shifts_of(tiles, middle, most)) <= 1 ? high : low) = middle;
  }
  return shifts_of(tiles, high, most);
}

/// relMSE × cost; the shared cost is that of the tile that has most.
double inefficiency(std::span<const TileNoise> tiles, std::span<const std::int8_t> shifts, double shared_cost) {
  double error = 0, cost = 0;
  int most = Allocation::kLeastShift;
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
    if (shifts[i] < kLeastShift || shifts[i] > kMostShift) {
      return invalid_argument("allocation: tile {} has shift {}, which must be from {} to {}", i, shifts[i],
                              kLeastShift, kMostShift);
    }
  }
  Allocation out;
  out.shifts_ = std::move(shifts);
  return out;
}

Gain allocate(std::span<const TileNoise> tiles, double shared_cost) {
  constexpr double kLeastGain = 1.02;
  for (const TileNoise& tile : tiles) {
    LM_CHECK(tile.pixels > 0 && tile.variance >= 0 && tile.cost >= 0);
  }
  Gain best;
  if (std::ranges::none_of(tiles, [](const TileNoise& tile) { return tile.variance > 0; })) {
    return best;
  }
  const double before = inefficiency(tiles, std::vector<std::int8_t>(tiles.size(), 0), shared_cost);
  for (int most = 1; most <= Allocation::kMostShift; ++most) {
    std::vector<std::int8_t> shifts = at_most_one(tiles, most);
    const double gain = before / inefficiency(tiles, shifts, shared_cost);
    if (gain >= kLeastGain && gain > best.gain) {
      best = {Allocation::of(std::move(shifts)).value(), gain};
    }
  }
  return best;
}

}  // namespace lightmill
