// Width of a material's lobes: narrow ones, and ones with a density.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

/// GGX alpha below which a lobe is narrow. About one path in 1/alpha² ≈ 1e5 that reaches the surface by chance meets a
/// light without extent, and none below ggx::kSmoothAlpha. Measured: at alpha 1e-4 to 1e-3, a million paths miss the
/// caustics of such a surface (tests/atlas).
inline constexpr double kNarrowAlpha = 3e-3;

/// Share of a material's scattered light in narrow lobes. For Phong's gloss, alpha² = 2/(exponent + 2). A roughness map
/// may make lobes narrow in places. This is assumed for casters, and ignored for others.
enum class NarrowLobes {
  none,
  some,  ///< some lobes
  all,   ///< all lobes, or there are none
};
NarrowLobes narrow_lobes(const Material& material);

/// Whether the material scatters in directions with a density, so that photons on it are visible.
bool receives_light(const Material& material);

}  // namespace lightmill
