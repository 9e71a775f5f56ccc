// Diffuse surfaces below a smooth dielectric coat.
#pragma once

#include <functional>

#include "common/scene/document/material.h"

namespace lightmill {

/// Applies `of` to each component. With a texture, this is exact for texels of 1/2.
TexturedColor changed_albedo(const TexturedColor& albedo, const std::function<double(double)>& of);

/// The albedo of a diffuse surface below a coat of this index, as the base colour of a principled material. Light that
/// leaves the surface is partly reflected back inside. So its albedo ρ counts as ρ(1 − F)/(1 − ρF), with the mean inner
/// reflectance F.
TexturedColor coated(const TexturedColor& albedo, double ior);

}  // namespace lightmill
