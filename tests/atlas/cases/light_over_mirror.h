// A light (I = π) at (0, 1, 0) over a mirror in the plane y = 0, and a white wall at x = 1: scene B of the exact
// answers. A sphere light has the same intensity in all directions. It gives the same irradiance to surfaces that see
// all of it.
#pragma once

#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

struct LightOverMirror {
  std::string subject{}, name{};
  double radius = 0;      ///< of the light; 0: a point
  bool textured = false;  ///< the light emits through a white texture, so no method samples it
  /// View of the wall or of its mirror image, in the scene's own units and place.
  AtlasView view{.eye = {-1, 0.5, 0}, .look_at = {1, 0.5, 0}};
  std::uint32_t bounces = 2;  ///< 2 for the wall, 3 for its image: no light scatters on the wall twice
  std::string mirror_material = R"("mirror": {})";
  std::function<double(double cosine)> reflectance = [](double) { return 1.0; };  ///< of the mirror
  std::string mirror{};  ///< objects that form the mirror; empty: an endless plane
  std::map<std::string, std::string> files{};
  /// Whether light from the mirror image of the light meets the mirror on its way to a point of the wall.
  std::function<bool(const Vec3d& from, const Vec3d& to)> reflected = [](const Vec3d&, const Vec3d&) { return true; };
  double scale = 1;  ///< factor of all lengths
  Vec3d offset{0};   ///< translation of the whole scene
  int steps = 200;   ///< of the formula's integral over the picture, along one side

  AtlasCase made() const;
};

}  // namespace lightmill::test
