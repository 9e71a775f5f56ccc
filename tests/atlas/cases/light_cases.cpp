// Many lights, grazing lights, invalid lights, and environments of one bright pixel.
#include <random>

#include "tests/atlas/cases/light_over_mirror.h"
#include "tests/atlas/cases/light_scenes.h"

namespace lightmill::test {
namespace {

/// A sun of irradiance π at this elevation over a mirror on the ground, and a white wall at x = 1 that it lights twice.
AtlasCase grazing_sun(double degrees) {
  const double angle = degrees * kPiDouble / 180, reach = 1 / std::tan(angle);
  const AtlasView view{.eye = {-1, 0.5, 0}, .look_at = {1, 0.5, 0}, .fov_degrees = 15};
  return {.subject = "grazing light",
          .name = fmt::format("a sun at {} degrees over a mirror", degrees),
          .document = document(
              view.text(), view.fov_degrees, view.size, diffuse("wall", 1) + also(named("mirror", R"("mirror": {})")),
              plane_shape("wall", "[1, 0, 0]", "[-1, 0, 0]") + also(mesh("mirror", "mirror.obj")),
              fmt::format(R"({{"directional": {{"direction": [{:.17g}, {:.17g}, 0], "irradiance": {}}}}})",
                          std::cos(angle), -std::sin(angle), gray(kPiDouble))),
          .files = {{"mirror.obj", horizontal_rectangle(-reach, 1, -0.5, 0.5, 0, true)}},
          .exact = 2 * std::cos(angle),
          .gathered = 2e-3,
          .max_bounces = 2,
          .level = 3,
          .quick = degrees >= 1};  // at lower angles few of the photons aimed at the mirror hit it
}

/// The same under a sky with one bright pixel above the horizon. Half of its light comes through the mirror.
AtlasCase pixel_over_mirror(int width) {
  const int height = width / 2, x = 0, y = height / 4;
  const AtlasView view{.eye = {-1, 0.5, 0}, .look_at = {1, 0.5, 0}, .fov_degrees = 15};
  const double direct =
      irradiance_of_pixel(width, height, x, y, 1e6, {-1, 0, 0}, 0) - kPiDouble;  // the excess over the sky's 1
  return {.subject = "one 1e6 pixel in an environment map",
          .name = fmt::format("of {}x{}, over a mirror, on a wall", width, height),
          .document = document(view.text(), view.fov_degrees, view.size,
                               diffuse("wall", 1) + also(named("mirror", R"("mirror": {})")),
                               plane_shape("wall", "[1, 0, 0]", "[-1, 0, 0]") + also(mesh("mirror", "mirror.obj")),
                               R"({"environment": {"file": "sky.exr"}})"),
          .files = {{"mirror.obj", horizontal_rectangle(-40, 1, -40, 40, 0, true)},
                    {"sky.exr", one_pixel(width, height, x, y, 1e6f)}},
          .exact = 1 + 2 * direct / kPiDouble,
          .tolerance = 3e-3,
          .max_bounces = 2,
          .level = 3};
}

AtlasCase even_sky(const std::string& subject, const std::string& name, const std::string& look, int width,
                   int height) {
  return {.subject = subject,
          .name = name,
          .document = mirror_ball_in_a_sky(look),
          .files = {{"sky.exr", one_pixel(width, height, 0, 0, 0.5f, 0.5f)}},
          .exact = 0.5,
          .level = 2};
}

constexpr const char* kNoNumbers = "NaN/Inf in vertices, normals, textures, lights";

AtlasCase refused(const std::string& name, const std::string& text, const std::map<std::string, std::string>& files,
                  const std::string& message) {
  return {.subject = kNoNumbers, .name = name, .document = text, .files = files, .refusal = message};
}

std::vector<AtlasCase> no_numbers() {
  const std::string plain = document(kAbove, 60, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj"));
  const std::string sky_text = document(kAbove, 60, 8, diffuse("floor", 0.5), sphere("floor", "[0, 0, 0]", 1),
                                        R"({"name": "world", "environment": {"file": "sky.exr"}})");
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  return {
      refused("vertices: nan", plain, {{"floor.obj", "v 0 0 0\nv 1 nan 0\nv 2 0 0\nf 1 2 3\n"}}, "floor.obj:2: "),
      refused("vertices: inf", plain, {{"floor.obj", "v 0 0 0\nv 1 -inf 0\nv 2 0 0\nf 1 2 3\n"}}, "floor.obj:2: "),
      {.subject = kNoNumbers,
       .name = "normals: nan, so the face is flat",
       .document = document(kAbove, 10, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj"), sky(1)),
       .files = {{"floor.obj", "v -9 0 9\nv 9 0 9\nv 0 0 -9\nvn nan 0 1\nf 1//1 2//1 3//1\n"}},
       .exact = 0.5,
       .level = 2},
      refused("environments: nan", sky_text, {{"sky.exr", one_pixel(8, 4, 3, 1, nan)}}, "pixel (3, 1) is not finite"),
      refused("environments: inf", sky_text, {{"sky.exr", one_pixel(8, 4, 3, 1, inf)}}, "pixel (3, 1) is not finite"),
      refused("lights: nan",
              document(kAbove, 60, 8, diffuse("floor", 1), sphere("floor", "[0, 0, 0]", 1),
                       R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, NaN, 1]}}})"),
              {}, "scene.json:")};
}

/// Points of all strengths over a white floor.
AtlasCase hundred_thousand_points() {
  const ManyPoints points = many_points(100'000);
  return {.subject = "1e5 lights",
          .name = "points of all strengths over a floor",
          .document = document(kDown, 0.01, 8, diffuse("floor", 1), mesh("floor", "floor.obj"), points.lights),
          .files = {{"floor.obj", plane(20, 0, true)}},
          .exact = points.radiance,
          .max_bounces = 1,
          .level = 5};
}

}  // namespace

std::vector<AtlasCase> light_cases() {
  std::vector<AtlasCase> cases;
  for (const double degrees : {30.0, 1.0, 0.1}) {
    cases.push_back(grazing_sun(degrees));
  }
  for (AtlasCase& each : no_numbers()) {
    cases.push_back(std::move(each));
  }
  cases.push_back(pixel_over_mirror(32));
  cases.push_back(pixel_over_mirror(256));
  cases.push_back(even_sky("its seam and poles", "the seam, 3x5 pixels", "[-1, 0, 0]", 3, 5));
  cases.push_back(even_sky("its seam and poles", "the upper pole, 64x32 pixels", "[0.0001, 1, 0]", 64, 32));
  cases.push_back(even_sky("its seam and poles", "the lower pole, one pixel", "[0.0001, -1, 0]", 1, 1));
  cases.push_back(hundred_thousand_points());
  cases.push_back(
      {.subject = "heavy-tailed samples",
       .name = "a dim point beside a glaring one that is hidden",
       .document = document(kDown, 0.01, 8, diffuse("floor", 1),
                            mesh("floor", "floor.obj") + also(sphere("floor", "[0, 4, 0]", 0.5)), glaring_and_dim()),
       .files = {{"floor.obj", plane(20, 0, true)}},
       .exact = 1 / kPiDouble,
       .max_bounces = 1,
       .level = 8});
  return cases;
}

}  // namespace lightmill::test
