#include "common/image/primaries.h"

#include <cmath>
#include <glm/glm.hpp>

namespace lightmill {
namespace {

constexpr Primaries kRec709{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}};

glm::dvec3 with_z(const std::array<double, 2>& xy) {
  return {xy[0], xy[1], 1 - xy[0] - xy[1]};
}

/// XYZ of white, with Y = 1.
glm::dvec3 white_of(const Primaries& primaries) {
  return with_z(primaries.white) / primaries.white[1];
}

glm::dmat3 chromaticities_of(const Primaries& p) {
  return {with_z(p.red), with_z(p.green), with_z(p.blue)};
}

/// The matrix that gives white for (1, 1, 1).
glm::dmat3 to_xyz(const Primaries& primaries) {
  const glm::dmat3 columns = chromaticities_of(primaries);
  const glm::dvec3 scale = glm::inverse(columns) * white_of(primaries);
  return {columns[0] * scale[0], columns[1] * scale[1], columns[2] * scale[2]};
}

/// Bradford's transform (K. Lam, "Metamerism and Colour Constancy", 1985), as in ICC profiles and ACES.
glm::dmat3 adaptation(const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dmat3 cones(0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296);  // columns
  const glm::dvec3 ratio = (cones * to) / (cones * from);
  return glm::inverse(cones) * glm::dmat3(ratio.x, 0, 0, 0, ratio.y, 0, 0, 0, ratio.z) * cones;
}

/// Files have rounded values.
bool alike(const Primaries& a, const Primaries& b) {
  constexpr double kRounding = 5e-4;
  const auto near = [](const std::array<double, 2>& p, const std::array<double, 2>& q) {
    return std::abs(p[0] - q[0]) < kRounding && std::abs(p[1] - q[1]) < kRounding;
  };
  return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue) && near(a.white, b.white);
}

/// Not a single line of colours, and every primary is needed for white.
bool span_colours(const Primaries& p) {
  constexpr double kMin = 1e-4, kMax = 10;
  for (const auto& [x, y] : {p.red, p.green, p.blue, p.white}) {
    if (!(std::abs(x) < kMax && std::abs(y) < kMax)) {
      return false;
    }
  }
  const glm::dmat3 columns = chromaticities_of(p);
  if (!(p.white[1] > kMin && std::abs(glm::determinant(columns)) > kMin)) {
    return false;
  }
  const glm::dvec3 scale = glm::abs(glm::inverse(columns) * white_of(p));
  return scale.x > kMin && scale.y > kMin && scale.z > kMin;
}

}  // namespace

Result<std::optional<glm::dmat3>> matrix_to_rec709(const Primaries& primaries) {
  if (alike(primaries, kRec709)) {
    return std::optional<glm::dmat3>();
  }
  if (!span_colours(primaries)) {
    const auto& [r, g, b, w] = primaries;
    return invalid_argument(
        "red ({:g}, {:g}), green ({:g}, {:g}), blue ({:g}, {:g}) and white ({:g}, {:g}) are not the chromaticities of "
        "a colour space",
        r[0], r[1], g[0], g[1], b[0], b[1], w[0], w[1]);
  }
  const glm::dmat3 from_xyz = glm::inverse(to_xyz(kRec709));
  if (alike(primaries, kXyzPrimaries)) {
    return std::optional(from_xyz);
  }
  return std::optional(from_xyz * adaptation(white_of(primaries), white_of(kRec709)) * to_xyz(primaries));
}

}  // namespace lightmill
