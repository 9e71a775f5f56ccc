// Subsurface scattering: media by the colour that they show.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

/// Single-scattering albedo of a thick body that returns the share `color` of diffuse light. The boundary does not
/// reflect. Van de Hulst's albedo (Multiple Light Scattering, 1980) as inverted by Kulla and Conty ("Revisiting
/// Physically Based Shading at Imageworks", 2017). With g = 0, the share returned is within 0.002 of `color`.
double scattering_albedo(double color, double anisotropy);

/// The share that such a body returns, by its single-scattering albedo: the inverse of scattering_albedo().
double returned_share(double albedo, double anisotropy);

/// The medium with this colour and extinction 1/(radius (1 − g)), by channel. Radii are above 0, in scene units.
Medium subsurface_medium(const RgbColor& color, const RgbColor& radius, double anisotropy);

}  // namespace lightmill
