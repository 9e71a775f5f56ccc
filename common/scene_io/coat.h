// Diffuse surfaces below a smooth dielectric coat.
#pragma once

#include <functional>

#include "common/scene/document/material.h"

namespace lightmill {

/// Sets the base colour to of(albedo). A texture gets an inner reflectance, because `of` is like `below_coat`. It is
/// exact for texels of 1/2.
void set_base_color(PrincipledMaterial& out, const TexturedColor& albedo, const std::function<double(double)>& of,
                    double inner_reflectance);

/// Mean reflectance of a smooth coat for uniform light from inside.
double inner_reflectance(double ior);

/// The albedo that a diffuse surface has below a coat of this inner reflectance. Light that leaves the surface is partly
/// reflected back to it.
double below_coat(double albedo, double inner_reflectance);

}  // namespace lightmill
