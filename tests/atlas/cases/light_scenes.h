// Scenes of lights that the map and other tests share.
#pragma once

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

inline constexpr const char* kDown = R"("eye": [0, 0.5, 0.01], "look_at": [0, 0, 0])";

/// Entries of a document's lights, and the red value that a white floor (y = 0) then shows at the origin.
struct ManyPoints {
  std::string lights;
  double radiance = 0;
};
ManyPoints many_points(int count);

/// A light of 100 W/sr at height 4, which a ball has to hide, and one of 1 W/sr at height 1.
std::string glaring_and_dim();

/// An environment with one value in all pixels except one, as an EXR file.
std::string one_pixel(int width, int height, int x, int y, float value, float other = 1);
/// Irradiance under such an environment of 1 and `value` on a surface with this normal. The environment is turned by
/// this many radians. The map is bilinear between pixel centres, wraps around, and is constant beyond the first and
/// last row.
double irradiance_of_pixel(int width, int height, int px, int py, double value, const Vec3d& normal, double turn);
/// The document of a mirror ball in the environment sky.exr, seen from beside it.
std::string mirror_ball_in_a_sky(const std::string& look_at);

}  // namespace lightmill::test
