// Interface of all BSDFs: sample, eval and pdf, eight lanes at a time.
//
// A BSDF is a struct of its parameters. Directions are unit vectors that point away from the surface, in a local frame
// whose z axis is the shading normal on the side of `wo`, so wo.z > 0.
//   - `eval(wo, wi)` is the BSDF times |cos θi|.
//   - `pdf_solid_angle(wo, wi)` is the density with which `sample(wo, u, choice)` draws wi. A sample's weight is eval /
//     pdf.
//   - A delta BSDF has no eval or pdf. Its sample's weight is the coefficient over the probability of the branch.
//   - Lobes may be delta in some lanes. There `eval` and the pdf omit them, and `smooth` returns exactly these lobes.
//   - `kTransmits`: light can pass to the other side.
//   - `kHasLobes`: `sample` uses `choice`.
//   - `kLosesSamples`: `sample` can return weight 0.
// Chi-squared tests check that all three agree.
#pragma once

#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill {

struct BsdfSample8 {
  V8 wi;
  V8 weight;
  F8 pdf_solid_angle;  ///< 0 for delta BSDFs
  M8 transmitted;      ///< wi is on the other side of the surface
  F8 eta = F8(1.0f);   ///< index of refraction behind the surface over that on wo's side, where transmitted; else 1
};

/// Delta lobes of a BSDF: the share of the radiance from wo's mirror direction, and from its refracted direction, that
/// goes to wo.
struct DeltaLobes8 {
  V8 reflected, refracted;
};

}  // namespace lightmill
