// Random numbers of a simulation, all from one seed.
#pragma once

#include <cstdint>

#include "common/base/clock.h"

namespace lightmill::simulation {

/// SplitMix64, with the same numbers on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t below(std::uint64_t limit) { return next() % limit; }
  bool chance(double probability) { return uniform() < probability; }
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  Duration seconds_between(double low, double high) { return from_seconds(between(low, high)); }

 private:
  std::uint64_t state_;
};

}  // namespace lightmill::simulation
