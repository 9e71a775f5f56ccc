// Diffuse surfaces below a smooth dielectric coat.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

/// The albedo of a diffuse surface below a coat of this index, as the base colour of a principled material. Light that
/// leaves the surface is partly reflected back inside. So its albedo ρ counts as ρ(1 − F)/(1 − ρF), with the mean inner
/// reflectance F. With a texture, this is exact for texels of 1/2.
TexturedColor coated(const TexturedColor& albedo, double ior);

}  // namespace lightmill
