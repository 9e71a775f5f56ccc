// Conversion of colours with other primaries to linear Rec. 709.
#pragma once

#include <array>
#include <glm/mat3x3.hpp>
#include <optional>

#include "common/base/status.h"

namespace lightmill {

/// CIE 1931 chromaticities (x, y) of an RGB colour space.
struct Primaries {
  std::array<double, 2> red, green, blue, white;
};

/// Primaries with which RGB values are CIE XYZ values.
inline constexpr Primaries kXyzPrimaries{{1, 0}, {0, 1}, {0, 0}, {1.0 / 3, 1.0 / 3}};

/// The matrix from colours with these primaries to Rec. 709 with white D65. Nothing if they are those of Rec. 709.
/// White stays white: Bradford's transform adapts colours from the white point to D65. CIE XYZ values are not adapted,
/// because they describe colours without a white point. INVALID_ARGUMENT if the primaries span no colours.
Result<std::optional<glm::dmat3>> matrix_to_rec709(const Primaries& primaries);

}  // namespace lightmill
