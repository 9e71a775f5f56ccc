// Mixtures of the materials of other renderers.
#pragma once

#include "common/scene/document/material.h"
#include "common/scene_io/notices.h"

namespace lightmill {

/// The material where the share `factor` of the light meets `second`, and the rest `first`. `map` multiplies the factor.
/// Smooth diffuse surfaces without textures become one. A dielectric of index 1 becomes transparency. Different normal
/// maps are left out, with a notice. The material has no name, and errors have no place.
Result<Material> mixed(const Material& first, const Material& second, double factor, const ScalarMap& map,
                       Notices& notices);

}  // namespace lightmill
