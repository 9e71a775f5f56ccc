// Whether a material scatters light narrowly, or in directions that have a density.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

/// GGX's α below which a lobe is narrow: a light without extent is met in one only by a path in 1/α² ≈ 1e5 that comes
/// there by chance, if at all (α below ggx::kSmoothAlpha: never). Measured: at α = 1e-4 to 1e-3 a million paths miss
/// the caustics of such a surface (tests/atlas).
inline constexpr double kNarrowAlpha = 3e-3;

/// How much of what a material scatters goes into narrow lobes; of Phong's gloss, α² = 2/(exponent + 2). A roughness
/// map may make lobes narrow in places, which is taken for granted of casters and not counted of others.
enum class NarrowLobes {
  none,
  some,  ///< beside others
  all,   ///< all that it scatters, if anything
};
NarrowLobes narrow_lobes(const Material& material);

/// Whether it scatters light in directions that have a density: photons that arrive there are seen.
bool receives_light(const Material& material);

}  // namespace lightmill
