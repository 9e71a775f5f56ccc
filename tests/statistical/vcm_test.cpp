// `vcm` shows the same pictures as other methods. Their strategies share nothing with most of its own.
//
// In the round room merging blurs a block's mean by less than half a percent. In scenes with edges it would blur more.
// There the radius is so small that almost nothing merges, and the rest has no bias.
#include "tests/statistical/round_room.h"

namespace lightmill::test {
namespace {

constexpr double kBlur = 0.005;
const char* const kMethod = "vcm:photons=2000";
const char* const kUnmerged = "vcm:photons=2000,radius=0.01";

TEST(Vcm, MatchesPathForASphereLight) {
  const TestScene scene = round_room("", also(diffuse("lamp", 0, 9)), also(sphere("lamp", "[0, 1.6, 0]", 0.5)));
  expect_same(scene, {.method = kMethod, .blur = kBlur});
}

TEST(Vcm, MatchesCausticForAPointLight) {
  expect_same(round_room(kPoint), {.method = kMethod, .reference = "caustic:photons=4000", .blur = kBlur});
}

TEST(Vcm, MatchesPathForGlossRoughMetalRoughGlassAndCoats) {
  const std::string materials =
      also(named(
          "gloss",
          R"("phong": {"diffuse": {"rgb": [0.3, 0.3, 0.4]}, "specular": {"rgb": [0.4, 0.4, 0.4]}, "exponent": 20})")) +
      also(named("gold", R"("conductor": {"metal": "gold", "roughness": 0.4})")) +
      also(named("frosted", R"("dielectric": {"ior": 1.5, "roughness": 0.5})")) +
      also(named("coat", R"("principled": {"base_color": {"rgb": [0.5, 0.6, 0.7]}, "roughness": 0.5, "coat": 1,
                           "coat_roughness": 0})")) +
      also(named("soap", R"("principled": {"base_color": {"rgb": [0.9, 0.6, 0.7]}, "roughness": 0.5,
                           "transmission": 0.7})")) +
      also(diffuse("lamp", 0, 9));
  const TestScene scene =
      round_room("", materials,
                 also(sphere("gloss", "[-0.5, 0.8, -0.5]", 0.4)) + also(sphere("gold", "[0.7, 0.7, 0]", 0.4)) +
                     also(sphere("frosted", "[0, 0.3, 0.9]", 0.3)) + also(sphere("coat", "[-0.2, -0.2, -1]", 0.4)) +
                     also(sphere("soap", "[-1.1, 0.6, 0.4]", 0.3)) + also(sphere("lamp", "[0, 2, 0]", 0.4)));
  expect_same(scene, {.method = kUnmerged});
}

/// Merging weighs transmitted light with its density in the other direction.
TEST(Vcm, MatchesPathForMergedRoughGlassAndMixtures) {
  const std::string materials =
      also(named("frosted", R"("dielectric": {"ior": 1.5, "roughness": 0.6})")) +
      also(named("soap", R"("principled": {"base_color": {"rgb": [0.9, 0.6, 0.7]}, "roughness": 0.6,
                           "transmission": 0.7})")) +
      also(diffuse("lamp", 0, 9));
  const TestScene scene =
      round_room("", materials,
                 also(sphere("frosted", "[-0.6, 0.7, 0]", 0.6)) + also(sphere("soap", "[0.7, 0.7, 0.2]", 0.6)) +
                     also(sphere("lamp", "[0, 2.2, 0]", 0.4)));
  expect_same(scene, {.method = kMethod, .blur = kBlur});
}

TEST(Vcm, MatchesCausticForAbsorptionAndSeveralKindsOfLights) {
  expect_same(amber_under_point_and_spot(), {.method = kMethod, .reference = "caustic:photons=4000", .blur = kBlur});
}

/// An open floor with a ball and a wall, lit from outside.
TestScene open_floor(const std::string& lights, const std::string& ball, const std::string& view) {
  return TestScene::from_text(
      document(view, 50, kFilm, diffuse("floor", 0.6) + also(named("ball", ball)),
               mesh("floor", "floor.obj") + also(mesh("floor", "back.obj")) + also(sphere("ball", "[0, 0.8, 0]", 0.6)),
               lights),
      {{"floor.obj", horizontal_square(5, 0, true)},
       {"back.obj", polygon({{-2.5, 0, -2.5}, {2.5, 0, -2.5}, {2.5, 4, -2.5}, {-2.5, 4, -2.5}})}});
}
const char* const kView = R"("eye": [0, 1.6, 4], "look_at": [0, 0.7, 0])";
const char* const kLens = R"("eye": [0, 1.6, 4], "look_at": [0, 0.7, 0], "lens_radius": 0.2, "focus_distance": 3,
                                "shift_x": 0.1, "shift_y": -0.15)";

TEST(Vcm, MatchesPathUnderSunAndSky) {
  expect_same(open_floor(R"({"directional": {"direction": [-0.4, -1, -0.3], "irradiance": {"rgb": [2, 2, 1]}}},
                            {"environment": {"radiance": {"rgb": [0.2, 0.3, 0.5]}}})",
                         R"("diffuse": {"reflectance": {"rgb": [0.5, 0.2, 0.2]}})", kView),
              {.method = kUnmerged});
}

TEST(Vcm, MatchesPathThroughAShiftedLens) {
  expect_same(open_floor(R"({"point": {"position": [1, 3, 2], "intensity": {"rgb": [9, 9, 9]}}})",
                         R"("diffuse": {"reflectance": {"rgb": [0.5, 0.2, 0.2]}})", kLens),
              {.method = kUnmerged});
}

TEST(Vcm, MatchesPathWithFewBounces) {
  const TestScene scene = round_room("", also(diffuse("lamp", 0, 9)), also(sphere("lamp", "[0, 1.6, 0]", 0.5)));
  for (const std::uint32_t bounces : {1u, 3u}) {
    expect_same(scene, {.method = kMethod, .bounces = bounces, .blur = kBlur});
  }
}

}  // namespace
}  // namespace lightmill::test
