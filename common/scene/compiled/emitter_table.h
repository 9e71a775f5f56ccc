// A table that finds the light of a hit: one number per primitive of every emissive geometry.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/simd.h"

namespace lightmill {

/// One row per geometry, in the order of Accel's indices.
class EmitterTable {
 public:
  /// Adds a geometry whose primitives are these lights. Empty if it is not a light, or is not sampled.
  void add_geometry(const std::vector<std::uint32_t>& lights) {
    first_.push_back(lights.empty() ? kNone : static_cast<std::uint32_t>(light_.size()));
    light_.insert(light_.end(), lights.begin(), lights.end());
  }
  struct Lights8 {
    M8 sampled;
    U8 light;  ///< number of the light, if sampled
  };
  Lights8 lookup(U8 geometry, U8 primitive, M8 lanes) const {
    const U8 first = gather(first_.data(), geometry, lanes);
    const M8 sampled = and_not(lanes, first == U8(kNone));
    return {sampled, gather(light_.data(), first + primitive, sampled)};
  }
  std::uint64_t bytes() const { return 4 * (first_.size() + light_.size()); }

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;
  std::vector<std::uint32_t> first_;  ///< by geometry, into light_; or kNone
  std::vector<std::uint32_t> light_;
};

}  // namespace lightmill
