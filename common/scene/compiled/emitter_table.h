// Which light of the light table is what a ray has hit: one number a primitive of every emissive geometry.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/simd.h"

namespace lightmill {

/// One row a geometry, in the order of Accel's indices.
class EmitterTable {
 public:
  /// A geometry whose primitives are these lights; empty where it is no light, or not one that is sampled.
  void add_geometry(const std::vector<std::uint32_t>& lights) {
    first_.push_back(lights.empty() ? kNone : static_cast<std::uint32_t>(light_.size()));
    light_.insert(light_.end(), lights.begin(), lights.end());
  }
  struct Lights8 {
    M8 sampled;
    U8 light;  ///< its number, where sampled
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
