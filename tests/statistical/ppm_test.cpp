// `ppm` gathers all light from photons. It shows the same pictures as methods that sample lights.
//
// In the round room gathering blurs a block's mean by less than half a percent.
#include "tests/statistical/round_room.h"

namespace lightmill::test {
namespace {

constexpr double kBlur = 0.005;

TEST(Ppm, MatchesPathForASphereLight) {
  expect_same(round_room("", also(diffuse("lamp", 0, 9)), also(sphere("lamp", "[0, 1.6, 0]", 0.5))),
              {.method = "ppm:photons=6000", .blur = kBlur});
}

TEST(Ppm, MatchesCausticForAPointLight) {
  expect_same(round_room(kPoint), {.method = "ppm:photons=6000", .reference = "caustic:photons=4000", .blur = kBlur});
}

TEST(Ppm, MatchesPathForGlossRoughMetalAndCoats) {
  const std::string materials =
      also(named(
          "gloss",
          R"("phong": {"diffuse": {"rgb": [0.3, 0.3, 0.4]}, "specular": {"rgb": [0.4, 0.4, 0.4]}, "exponent": 20})")) +
      also(named("gold", R"("conductor": {"metal": "gold", "roughness": 0.25})")) +
      also(named("coat", R"("principled": {"base_color": {"rgb": [0.5, 0.6, 0.7]}, "roughness": 0.5, "coat": 1,
                           "coat_roughness": 0})")) +
      also(diffuse("lamp", 0, 9));
  expect_same(round_room("", materials,
                         also(sphere("gloss", "[-0.5, 0.8, -0.5]", 0.4)) + also(sphere("gold", "[0.7, 0.7, 0]", 0.4)) +
                             also(sphere("coat", "[-0.2, -0.2, -1]", 0.4)) + also(sphere("lamp", "[0, 2, 0]", 0.4))),
              {.method = "ppm:photons=6000", .blur = kBlur});
}

TEST(Ppm, MatchesCausticForAbsorptionAndSeveralKindsOfLights) {
  expect_same(amber_under_point_and_spot(),
              {.method = "ppm:photons=6000", .reference = "caustic:photons=4000", .blur = kBlur});
}

}  // namespace
}  // namespace lightmill::test
