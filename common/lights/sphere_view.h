// Spheres as seen from a point outside.
#pragma once

#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill {

struct SphereView8 {
  V8 to_center;
  F8 center2;        ///< squared distance of the centre
  M8 outside;        ///< the point is outside
  F8 cos_max;        ///< of the cone that the sphere subtends, if outside
  F8 one_minus_cos;  ///< 1 − cos_max
  SphereView8(const V8& p, const V8& center, F8 radius) : to_center(center - p), center2(length_squared(to_center)) {
    const F8 sin2_max = radius * radius / center2;
    outside = sin2_max < F8(1.0f);
    cos_max = sqrt(max(F8(1.0f) - sin2_max, F8(0.0f)));
    one_minus_cos = sin2_max / (F8(1.0f) + cos_max);
  }

  struct Entry8 {
    V8 wi;      ///< unit, uniform in the cone
    V8 normal;  ///< unit, where this direction enters the sphere
  };
  Entry8 sample(F8 radius, Pair8 u) const {
    const V8 local = square_to_cone(u, one_minus_cos);
    const F8 center_distance = sqrt(center2);
    const Frame8 cone(to_center * (F8(1.0f) / center_distance));
    const F8 sin2 = local.x * local.x + local.y * local.y;  // 1 − z² would cancel for small solid angles
    const F8 entry = center_distance * local.z - sqrt(max(radius * radius - center2 * sin2, F8(0.0f)));
    // The entry relative to the centre. It is accurate also if the sphere is smaller than the coordinates' precision.
    const F8 aside = entry / radius;
    const F8 nx = local.x * aside, ny = local.y * aside;
    return {cone.to_world(local), cone.to_world({nx, ny, -sqrt(max(F8(1.0f) - nx * nx - ny * ny, F8(0.0f)))})};
  }
};

}  // namespace lightmill
