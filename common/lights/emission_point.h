// Where light starts, when it is followed from its source.
#pragma once

#include "common/math/vec.h"

namespace lightmill {

/// A point on an emissive surface, or the place of a light without extent: then all but `point` is without meaning.
struct EmissionPoint8 {
  V8 point;
  V8 normal;     ///< unit, to the side that emits; to either one where both do
  F8 offset;     ///< along the normal: how far off the surface a ray starts so that it does not find it again
  F8 area;       ///< 1 / pdf_area
  V8 texture;    ///< what the surface's radiance is multiplied by
  M8 surface;    ///< not a light without extent
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
