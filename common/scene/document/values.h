// Points and colours of the scene document. Lengths are in scene units (metres where it matters), angles in degrees.
#pragma once

#include <array>

namespace lightmill {

using Point3d = std::array<double, 3>;  ///< x, y, z

inline constexpr double kMaxCoordinate = 1e12;  ///< of any point, in scene units: single precision must hold squares

/// Linear RGB with Rec. 709 primaries. Another kind (a spectrum) could join as an alternative in the schema.
struct RgbColor {
  float r = 0, g = 0, b = 0;
  friend bool operator==(const RgbColor&, const RgbColor&) = default;
};
inline bool is_black(const RgbColor& color) {
  return color == RgbColor{};
}

}  // namespace lightmill
