// Which materials send light on as mirrors and lenses do, so that it gathers in caustics.
#pragma once

#include <vector>

#include "common/scene/document.h"

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

/// GGX's α below which a lobe is narrow: a light without extent is met in one only by a path in 1/α² ≈ 1e5 that comes
/// there by chance, if at all (α below ggx::kSmoothAlpha: never). Measured: at α = 1e-4 to 1e-3 a million paths miss
/// what such a surface throws (tests/atlas).
inline constexpr double kNarrowAlpha = 3e-3;

/// How much of what a material scatters goes into narrow lobes; of Phong's gloss, α² = 2/(exponent + 2). A roughness
/// map may make lobes narrow in places, which is taken for granted of casters and not counted of others.
enum class NarrowLobes {
  none,
  some,  ///< beside others
  all,   ///< all that it scatters, if anything
};
NarrowLobes narrow_lobes(const Material& material);

/// Whether it scatters light in directions that have a density: what a lamp sends there is seen on it.
bool receives_light(const Material& material);

}  // namespace lightmill
