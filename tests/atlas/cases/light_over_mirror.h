// A light (I = π) at (0, 1, 0) over a mirror in the plane y = 0, and a white wall at x = 1: scene B of the exact
// answers. A lamp with an extent has the same intensity in all directions, and the same irradiance on what it is wholly
// above.
#pragma once

#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

struct LightOverMirror {
  std::string subject{}, name{};
  double radius = 0;      ///< of the lamp; 0: a point
  bool textured = false;  ///< the lamp, by a white picture: then no method samples it
  /// Of the wall, or of its image in the mirror; in the scene's own units and place.
  AtlasView view{.eye = {-1, 0.5, 0}, .look_at = {1, 0.5, 0}};
  std::uint32_t bounces = 2;  ///< 2 for the wall itself, 3 for its image: then nothing comes off the wall twice
  std::string mirror_material = R"("mirror": {})";
  std::function<double(double cosine)> reflectance = [](double) { return 1.0; };  ///< of that
  std::string mirror{};  ///< objects that are the mirror; empty: a plane without end
  std::map<std::string, std::string> files{};
  /// Whether light from the lamp's image meets the mirror on its way to a place of the wall.
  std::function<bool(const Vec3d& from, const Vec3d& to)> reflected = [](const Vec3d&, const Vec3d&) { return true; };
  double scale = 1;  ///< all lengths are multiplied by it
  Vec3d offset{0};   ///< and all is moved by it
  int steps = 200;   ///< of the formula's integral over the picture, along a side

  AtlasCase made() const;
};

}  // namespace lightmill::test
