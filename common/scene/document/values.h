// Points and colours of the scene document. Lengths are in scene units (metres if it matters), angles in degrees.
#pragma once

#include <array>

namespace lightmill {

using Point3d = std::array<double, 3>;  ///< x, y, z

inline constexpr double kMaxCoordinate = 1e12;  ///< of any point, scene units: squares must fit into single precision

/// Linear RGB with Rec. 709 primaries. The schema has room for other kinds, such as a spectrum.
struct RgbColor {
  float r = 0, g = 0, b = 0;
  friend bool operator==(const RgbColor&, const RgbColor&) = default;
};
inline bool is_black(const RgbColor& color) {
  return color == RgbColor{};
}

}  // namespace lightmill
