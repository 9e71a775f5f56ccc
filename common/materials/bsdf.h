// What every BSDF here gives: sample, eval and pdf, eight lanes at a time.
//
// A BSDF is a struct of its parameters. Directions are unit vectors in a local frame whose z axis is the shading normal
// on the side of `wo`, both pointing away from the surface; wo.z > 0. `eval(wo, wi)` is the BSDF times |cos θi|,
// `pdf_solid_angle(wo, wi)` the density with which `sample(wo, u, choice)` draws wi; its weight is eval / pdf. A delta
// BSDF has no eval or pdf; its sample's weight is the coefficient over the probability of the branch taken.
// Lobes may be delta in some lanes only: `eval` and the pdf leave them out there, and `smooth` gives exactly these.
// `kTransmits` says whether light may pass to the other side, `kHasLobes` whether `sample` looks at `choice`,
// `kLosesSamples` whether it may draw directions of weight 0.
// Chi-squared tests hold the three together.
#pragma once

#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill {

struct BsdfSample8 {
  V8 wi;
  V8 weight;
  F8 pdf_solid_angle;  ///< 0 for delta BSDFs
  M8 transmitted;      ///< wi is on the other side of the surface
  F8 eta = F8(1.0f);   ///< index of refraction beyond the surface over that on wo's side, where transmitted; else 1
};

/// The delta lobes of a BSDF: which part of the radiance from wo's mirror image, and from where wo is refracted to,
/// goes to wo.
struct SmoothLobes8 {
  V8 reflected, refracted;
};

}  // namespace lightmill
