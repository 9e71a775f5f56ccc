// Which materials send light on as mirrors and lenses do, so that it gathers in caustics.
#pragma once

#include <vector>

#include "common/scene/document/material.h"

namespace lightmill {

/// GGX's α (roughness squared) below which a rough surface still casts caustics.
inline constexpr double kCasterAlpha = 0.1;

/// Whether the material as a whole is a caster, C, and not a receiver, D, where light paths are told apart by how they
/// start (light → C⁺ → D …): a mirror, a dielectric or metal with α below kCasterAlpha, or a principled material
/// without a diffuse part of which every lobe is so narrow. Roughness maps multiply the roughness by at most 1 and make
/// no caster a receiver; a metallic map leaves a diffuse part.
bool is_caster(const Material& material);

/// One of the lobes by which a caster sends light on.
struct CasterLobe {
  double share = 1;  ///< about how much of the light
  double alpha = 0;  ///< GGX's α of a metal that spreads light as wide when hit at right angles; 0: not at all
};
/// Of a caster; their shares are 1 together. It is taken for a ball, and what matters is the mean brightness that it
/// shows, weighted with itself. A metal that is hit at θ spreads light over cos θ times the solid angle (Walter et al.
/// 2007, equation 14): of rays that go on to what lies beside and below the ball, cos θ < 0.7, the mean of 1/cos θ is
/// 2.86. Of these a coat reflects 13 % (Schlick). Glass turns light by |n − 1| of what its normal tilts where metals
/// turn it by twice that, and spreads it wider where light leaves it slantwise: twice as wide comes near to what was
/// measured on balls. Where a map says how rough it is, it is taken to be smooth.
std::vector<CasterLobe> caster_lobes(const Material& material);

}  // namespace lightmill
