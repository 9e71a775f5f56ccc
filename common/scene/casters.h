// Casters: materials that reflect or refract light as mirrors and lenses do, and so cause caustics.
#pragma once

#include <vector>

#include "common/scene/document/material.h"

namespace lightmill {

/// GGX's alpha (roughness squared) below which a rough surface still casts caustics.
inline constexpr double kCasterAlpha = 0.1;

/// Whether the material is a caster (C) or a receiver (D). Light paths are classified by their start: light → C⁺ → D …
/// Casters are mirrors, dielectrics and metals with alpha below kCasterAlpha. So are principled materials without a
/// diffuse part or sheen, if every lobe is as narrow. Anisotropic metal counts with its mean roughness. Roughness maps
/// multiply the roughness by at most 1, so they make no caster a receiver. A metallic map leaves a diffuse part. A mixture
/// is a caster if a part is one.
bool is_caster(const Material& material);

/// One of the lobes of a caster.
struct CasterLobe {
  double share = 1;  ///< approximate share of the light
  double alpha = 0;  ///< GGX's alpha of a metal with the same spread at normal incidence; 0: no spread
};
/// The lobes of a caster, or of the casters in a mixture. Their shares have the sum 1. The estimates are for a sphere, and for the radiance-weighted
/// mean of its radiance. A roughness map is ignored: the material is taken as smooth.
std::vector<CasterLobe> caster_lobes(const Material& material);

}  // namespace lightmill
