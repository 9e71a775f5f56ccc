// Choosing one of many lights by what each may contribute at a point.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/lights/light_sample.h"

namespace lightmill {

/// A binary tree of lights, descended at random by an upper bound of what either side contributes: its power over its
/// squared distance, times the cosine of the least angle that any of its normals can have to the point. Conty Estevez
/// and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", as in pbrt-v4, without the
/// receiver's normal: what a point draws must be computable from the point alone. Lights that cannot shine on a point
/// are not drawn; all others have a positive probability. Immutable once built.
class LightBvh {
 public:
  LightBvh() = default;
  /// At least one light; all powers are positive.
  explicit LightBvh(std::span<const LightBounds> lights);

  struct Choice8 {
    U8 light;
    F8 pmf;  ///< 0 where no light shines on the point
  };
  /// `more` is a second number, for where the first one's bits are used up.
  Choice8 sample(const V8& p, F8 u, F8 more) const;
  /// The probability with which `sample` gives this light; the same bits.
  F8 pmf(const V8& p, U8 light, M8 lanes) const;
  std::uint64_t bytes() const { return center_.size() * 64 + trail_.size() * 4; }

 private:
  struct Builder;
  F8 importance(const V8& p, U8 node, M8 lanes) const;
  /// Probability of going on to a node's first child, and whether either can be gone to.
  struct Split8 {
    F8 first;
    M8 any;
  };
  Split8 split(const V8& p, U8 node, U8 second, M8 lanes) const;

  // One row a node: first children follow their parent.
  VectorRows center_, axis_;
  std::vector<float> radius2_;  ///< of the sphere around the bounds, squared
  std::vector<float> cos_normals_, sin_normals_, cos_emission_, power_;
  std::vector<std::uint32_t> two_sided_;
  std::vector<std::uint32_t> second_child_;  ///< 0 for leaves
  std::vector<std::uint32_t> light_;         ///< of leaves
  std::vector<std::uint32_t> trail_;  ///< by light: bit d says that its leaf is below the second child at depth d
};

}  // namespace lightmill
