// Light BVH: a random choice among many lights, by upper bounds of their irradiance at a point.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/lights/light_sample.h"

namespace lightmill {

/// A binary tree of lights. Each node has a bound of its irradiance at a point: the largest intensity over the squared
/// distance, times the cosine of the smallest angle between a normal and the direction to the point. A child is chosen
/// in proportion to its bound. Lights that cannot illuminate a point are never chosen, all others may be. The
/// receiver's normal is not used, because a ray that hits a light knows only its origin. Immutable once built.
/// Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", as in pbrt-v4.
class LightBvh {
 public:
  /// Smallest intensity over the unit, so that bounds at a distance are normal numbers.
  static constexpr double kMinBound = 1e-20;

  LightBvh() = default;
  /// Needs at least one light. All powers and intensities must be positive. Bounds are divided by `unit`.
  LightBvh(std::span<const LightBounds> lights, double unit);

  /// The roots of at most `most` subtrees that hold all lights. The largest ones are split first. Called once.
  std::vector<std::uint32_t> cut(std::size_t most);
  bool is_leaf(std::uint32_t node) const { return second_child_[node] == 0; }
  /// Number of the root, as in the vector of `cut`, above a light.
  U8 root_of(U8 light, M8 lanes) const { return gather(root_.data(), light, lanes); }
  /// Bound of the irradiance at p from all lights below a node.
  F8 bound(const V8& p, std::uint32_t node) const;
  Vec3 center(std::uint32_t node) const { return center_[node]; }
  float radius2(std::uint32_t node) const { return radius2_[node]; }
  float intensity(std::uint32_t node) const { return intensity_[node]; }
  /// The directions in which the lights below a node shine. A cosine of -1 is all of them.
  struct Cone {
    Vec3d axis;
    double cosine;
  };
  Cone emission_cone(std::uint32_t node) const;

  struct Choice8 {
    U8 light;
    F8 pmf;  ///< 0 if no light can illuminate the point
  };
  /// Chooses a light below a node that was chosen with probability `pmf`. The result's probability is that of both.
  /// `more`: a second number, for when the bits of the first are used up.
  Choice8 sample(const V8& p, U8 node, F8 pmf, F8 u, F8 more) const;
  /// The probability that `sample` returns this light, with the same bits. `node`: its root.
  F8 pmf(const V8& p, U8 light, U8 node, F8 pmf, M8 lanes) const;
  std::uint64_t bytes() const { return center_.size() * 64 + trail_.size() * 8; }

 private:
  struct Builder;
  /// The inputs of a node's bound.
  struct Node8 {
    V8 center, axis;
    F8 radius2, cos_normals, sin_normals, cos_emission, intensity;
    M8 two_sided;
  };
  Node8 gathered(U8 node, M8 lanes) const;
  static F8 bound(const V8& p, const Node8& node);
  /// Probability of descending to the first child, and whether any child can be chosen.
  struct Split8 {
    F8 first;
    M8 any;
  };
  Split8 split(const V8& p, U8 node, U8 second, M8 lanes) const;

  // One row per node. First children follow their parents.
  VectorRows center_, axis_;
  std::vector<float> radius2_;  ///< squared radius of the sphere around the bounds
  std::vector<float> cos_normals_, sin_normals_, cos_emission_, intensity_;
  std::vector<std::uint32_t> two_sided_;
  std::vector<std::uint32_t> second_child_;  ///< 0 for leaves
  std::vector<std::uint32_t> light_;         ///< of leaves
  std::vector<std::uint32_t> trail_;  ///< by light: bit d is set if its leaf is below the second child at depth d
  std::vector<std::uint32_t> root_;   ///< by light
};

}  // namespace lightmill
