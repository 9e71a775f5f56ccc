// Rays and hits, eight at a time.
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

}  // namespace lightmill
