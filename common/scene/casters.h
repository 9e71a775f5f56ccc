// Which materials send light on as mirrors and lenses do, so that it gathers in caustics.
#pragma once

#include "common/scene/document.h"

namespace lightmill {

/// GGX's α (roughness squared) below which a rough surface still casts caustics.
inline constexpr double kCasterAlpha = 0.1;

/// Whether the material as a whole is a caster, C, and not a receiver, D, where light paths are told apart by how they
/// start (light → C⁺ → D …): a mirror, a dielectric or metal with α below kCasterAlpha, or a principled material
/// without a diffuse part of which every lobe is so narrow. Roughness maps multiply the roughness by at most 1 and make
/// no caster a receiver; a metallic map leaves a diffuse part.
bool is_caster(const Material& material);

/// How much of what a material scatters goes into single directions (α below ggx::kSmoothAlpha): no light sampled from
/// such a surface is ever seen in it. A roughness map may do so in places, which is not counted.
enum class DeltaLobes {
  none,
  some,  ///< beside others
  all,   ///< all that it scatters, if anything
};
DeltaLobes delta_lobes(const Material& material);

/// Whether it scatters light in directions that have a density: what a lamp sends there is seen on it.
bool receives_light(const Material& material);

}  // namespace lightmill
