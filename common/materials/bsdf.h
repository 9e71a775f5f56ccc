// What every BSDF here gives: sample, eval and pdf, eight lanes at a time.
//
// Directions are unit vectors in a local frame whose z axis is the shading normal on the side of `wo`, both pointing
// away from the surface; wo.z > 0. `eval` is the BSDF times |cos θi|, `pdf` is per solid angle, and `sample` draws wi
// with that pdf and returns weight = eval / pdf. A delta BSDF has no eval or pdf; its sample's weight is the
// coefficient over the probability of the branch taken. Chi-squared tests hold the three together.
#pragma once

#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill {

struct BsdfSample8 {
  V8 wi;
  V8 weight;
  F8 pdf_solid_angle;  ///< 0 for delta BSDFs
};

}  // namespace lightmill
