#include "common/film/allocation.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// The power of two that is nearest to `weight`, within limits; without logarithms, whose bits differ.
std::int8_t nearest_shift(double weight, int most) {
  constexpr double kHalfStep = 1.4142135623730951;  // √2
  int shift = Allocation::kLeastShift;
  while (shift < most && weight >= std::ldexp(kHalfStep, shift)) {
    ++shift;
  }
  return static_cast<std::int8_t>(shift);
}

std::vector<std::int8_t> shifts_of(std::span<const double> weights, double scale, int most) {
  std::vector<std::int8_t> shifts;
  for (const double weight : weights) {
    shifts.push_back(nearest_shift(weight * scale, most));
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

/// The largest scale, within rounding, at which tiles have no more than one sample on average.
std::vector<std::int8_t> at_most_one(std::span<const TileNoise> tiles, std::span<const double> weights, int most) {
  double low = 0x1p-60, high = 0x1p60;
  for (int step = 0; step < 200; ++step) {
    const double middle = std::sqrt(low * high);
    (mean_share(tiles, shifts_of(weights, middle, most)) <= 1 ? low : high) = middle;
  }
  return shifts_of(weights, low, most);
}

/// relMSE × cost; the shared cost is that of the tile that has most.
double inefficiency(std::span<const TileNoise> tiles, std::span<const std::int8_t> shifts, double shared_cost) {
  double error = 0, cost = 0;
  int most = Allocation::kLeastShift;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    error += std::ldexp(tiles[i].pixels * tiles[i].variance, -shifts[i]);
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
  std::vector<double> weights;
  for (const TileNoise& tile : tiles) {
    LM_CHECK(tile.pixels > 0 && tile.variance >= 0 && tile.cost >= 0);
    weights.push_back(tile.cost > 0 ? std::sqrt(tile.variance / tile.cost) : 0);
  }
  Gain best;
  const std::vector<std::int8_t> even(tiles.size(), 0);
  const double before = inefficiency(tiles, even, shared_cost);
  for (int most = 1; most <= Allocation::kMostShift && std::ranges::any_of(weights, [](double w) { return w > 0; });
       ++most) {
    std::vector<std::int8_t> shifts = at_most_one(tiles, weights, most);
    const double gain = before / inefficiency(tiles, shifts, shared_cost);
    if (gain >= kLeastGain && gain > best.gain) {
      best = {Allocation::of(std::move(shifts)).value(), gain};
    }
  }
  return best;
}

}  // namespace lightmill
