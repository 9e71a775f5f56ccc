// Eight rays, and their hits.
#pragma once

#include "common/math/vec.h"

namespace lightmill {

struct Ray8 {
  V8 origin;
  V8 direction;     ///< need not be a unit vector; distances are in its length
  F8 max_distance;  ///< hits lie in (0, max_distance)
};

struct Hit8 {
  M8 hit;
  F8 distance;
  V8 normal;     ///< geometric, not normalised
  F8 u, v;       ///< barycentric coordinates of the second and third corner
  U8 geometry;   ///< index of the mesh or sphere
  U8 primitive;  ///< triangle within the mesh
};
inline Hit8 select(M8 mask, const Hit8& yes, const Hit8& no) {
  return {(mask & yes.hit) | and_not(no.hit, mask),
          select(mask, yes.distance, no.distance),
          select(mask, yes.normal, no.normal),
          select(mask, yes.u, no.u),
          select(mask, yes.v, no.v),
          select(mask, yes.geometry, no.geometry),
          select(mask, yes.primitive, no.primitive)};
}

}  // namespace lightmill
