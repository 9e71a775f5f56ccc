// Affine maps in double precision, from the document's form.
#pragma once

#include <algorithm>
#include <cmath>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "common/math/vec.h"
#include "common/scene/document.h"

namespace lightmill {

/// v times the power of two that brings its largest component near 1. Squares then neither underflow nor overflow.
inline Vec3d near_one(const Vec3d& v) {
  const int exponent = std::ilogb(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
  return {std::scalbn(v.x, -exponent), std::scalbn(v.y, -exponent), std::scalbn(v.z, -exponent)};
}

/// p ↦ linear · p + translation.
struct Affine {
  glm::dmat3 linear{1.0};
  Vec3d translation{0};
  bool identity = true;

  Affine() = default;
  explicit Affine(const Transform& t)
      : linear(Vec3d(t[0][0], t[1][0], t[2][0]), Vec3d(t[0][1], t[1][1], t[2][1]), Vec3d(t[0][2], t[1][2], t[2][2])),
        translation(t[0][3], t[1][3], t[2][3]),
        identity(t == kIdentityTransform) {}

  Vec3d operator()(const Vec3d& p) const { return identity ? p : linear * p + translation; }
  double determinant() const { return glm::determinant(linear); }
  bool mirrors() const { return determinant() < 0; }
  /// Scale of lengths of a similarity: the length of a column. Uses only correctly rounded operations.
  double similarity_scale() const {
    const Vec3d& x = linear[0];
    const int exponent = std::ilogb(std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}));
    return std::scalbn(glm::length(near_one(x)), exponent);
  }
  /// Maps normals, not to unit length. They stay on the outer side if the map mirrors.
  glm::dmat3 normal_matrix() const { return glm::transpose(glm::inverse(linear)); }
};

}  // namespace lightmill
