// Scenes of lights that both the map and tests of their own look at.
#pragma once

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

inline constexpr const char* kDown = R"("eye": [0, 0.5, 0.01], "look_at": [0, 0, 0])";

/// Entries of a document's lights, and what they make a white floor (y = 0) show at the origin: red alone.
struct ManyPoints {
  std::string lights;
  double radiance = 0;
};
ManyPoints many_points(int count);

/// One of 100 W/sr at height 4, which a ball is to hide, and one of 1 W/sr at height 1.
std::string glaring_and_dim();

/// An environment of one value but for one pixel, as an EXR file.
std::string one_pixel(int width, int height, int x, int y, float value, float other = 1);
/// Irradiance under such an environment of 1 and `value` on a surface with this normal, turned by so many radians: the
/// map is bilinear between pixel centres, goes round, and is constant beyond the first and last row's.
double irradiance_of_pixel(int width, int height, int px, int py, double value, const Vec3d& normal, double turn);
/// The document of a mirror ball in the environment sky.exr, seen from beside it.
std::string mirror_ball_in_a_sky(const std::string& look_at);

}  // namespace lightmill::test
