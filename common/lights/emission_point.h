// Start point of light paths on a light.
#pragma once

#include "common/math/vec.h"

namespace lightmill {

/// A point on an emissive surface, or the position of a light without extent. Then only `point` has a meaning.
struct EmissionPoint8 {
  V8 point;
  V8 normal;     ///< unit, to the emitting side; to either side if both emit
  F8 offset;     ///< along the normal, so that a ray does not hit the surface again
  F8 area;       ///< 1 / pdf_area
  V8 texture;    ///< factor of the surface's radiance
  M8 surface;    ///< false for lights without extent
  M8 two_sided;  ///< light leaves both sides
};

/// `lanes` of a, else b.
inline EmissionPoint8 merge(M8 lanes, const EmissionPoint8& a, const EmissionPoint8& b) {
  return {select(lanes, a.point, b.point),        select(lanes, a.normal, b.normal),
          select(lanes, a.offset, b.offset),      select(lanes, a.area, b.area),
          select(lanes, a.texture, b.texture),    select(lanes, a.surface, b.surface),
          select(lanes, a.two_sided, b.two_sided)};
}

}  // namespace lightmill
