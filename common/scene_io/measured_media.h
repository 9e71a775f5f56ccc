// Measured media that scenes of pbrt name.
#pragma once

#include <optional>
#include <string_view>

#include "common/scene/document/material.h"

namespace lightmill {

/// The medium of this name, such as Skin1, per millimetre. Its scattering coefficient is the reduced one, so its phase
/// function is isotropic.
std::optional<Medium> measured_medium(std::string_view name);

}  // namespace lightmill
