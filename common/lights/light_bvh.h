// Light BVH: chooses one of many lights by an upper bound of its contribution at a point.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/lights/light_sample.h"

namespace lightmill {

/// A binary tree of lights. Each node has an upper bound of its contribution: power over squared distance, times the
/// cosine of the smallest angle between a normal and the direction to the point. A child is chosen at random in
/// proportion to its bound.
///
/// Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", as in pbrt-v4. The
/// receiver's normal is not used, because the choice must be computable from the point alone. Lights that cannot shine
/// on a point are not chosen. All others have a positive probability. Immutable once built.
class LightBvh {
 public:
  LightBvh() = default;
  /// Needs at least one light. All powers must be positive.
  explicit LightBvh(std::span<const LightBounds> lights);

  struct Choice8 {
    U8 light;
    F8 pmf;  ///< 0 if no light can shine on the point
  };
  /// `more`: a second number, for when the bits of the first are used up.
  Choice8 sample(const V8& p, F8 u, F8 more) const;
  /// The probability that `sample` returns this light, with the same bits.
  F8 pmf(const V8& p, U8 light, M8 lanes) const;
  std::uint64_t bytes() const { return center_.size() * 64 + trail_.size() * 4; }

 private:
  struct Builder;
  F8 importance(const V8& p, U8 node, M8 lanes) const;
  /// Probability of descending to the first child, and whether any child can be chosen.
  struct Split8 {
    F8 first;
    M8 any;
  };
  Split8 split(const V8& p, U8 node, U8 second, M8 lanes) const;

  // One row per node. First children follow their parents.
  VectorRows center_, axis_;
  std::vector<float> radius2_;  ///< squared radius of the sphere around the bounds
  std::vector<float> cos_normals_, sin_normals_, cos_emission_, power_;
  std::vector<std::uint32_t> two_sided_;
  std::vector<std::uint32_t> second_child_;  ///< 0 for leaves
  std::vector<std::uint32_t> light_;         ///< of leaves
  std::vector<std::uint32_t> trail_;  ///< by light: bit d is set if its leaf is below the second child at depth d
};

}  // namespace lightmill
