// Shadow catchers show the background times the ratio of arriving light to unshadowed light, through public documents.
#include <cmath>

#include "common/scene/validate/validate.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

constexpr const char* kMaterials =
    R"({"name": "floor", "shadow_catcher": {}}, {"name": "black", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}},
       {"name": "white", "diffuse": {"reflectance": {"rgb": [1, 1, 1]}}})";
constexpr const char* kFloor = R"({"material": "floor", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}})";
constexpr const char* kColoredSky = R"({"environment": {"radiance": {"rgb": [0.5, 2, 4]}}})";

/// The floor's layers at (x, 0, 0), seen from the side.
std::array<Estimate, 3> floor_layers_at(double x, const std::string& more_objects, const std::string& lights,
                                        std::uint32_t level = 9, const std::string& method = "path") {
  const auto scene =
      TestScene::from_text(document(fmt::format(R"("eye": [{}, 0.3, 0], "look_at": [{}, 0, 0])", x + 1.5, x), 0.001, 8,
                                    kMaterials, std::string(kFloor) + more_objects, lights));
  const auto rendered = scene.render({method, 3, 0}, level);
  return {mean_of(rendered, 0), mean_of(rendered, 1), mean_of(rendered, 2)};
}

TEST(ShadowCatcher, ShowsTheBackgroundWithoutObjects) {
  const std::string lights =
      std::string(kColoredSky) + R"(, {"directional": {"direction": [1, -1, 0], "irradiance": {"rgb": [3, 3, 3]}}})";
  const std::string sized =
      std::string(kColoredSky) +
      R"(, {"directional": {"direction": [1, -1, 0], "irradiance": {"rgb": [3, 3, 3]}, "angle_degrees": 100}},
           {"point": {"position": [2, 1, 0], "intensity": {"rgb": [4, 4, 4]}, "radius": 0.9}},
           {"disk": {"position": [0, 2, 1], "direction": [0, -1, -0.5], "radiance": {"rgb": [3, 3, 3]}}})";
  for (const std::string& light : {std::string(kColoredSky), lights, sized}) {
    const auto seen = floor_layers_at(0.2, "", light);
    expect_answer(seen[0], 0.5, 1e-2);
    expect_answer(seen[2], 4, 1e-2);
  }
}

TEST(ShadowCatcher, LosesTheSkyThatASphereHides) {
  // A sphere fills h R² / d³ of the plane's cosine-weighted sky.
  struct Case {
    double radius, height, x, exact;
  };
  for (const Case& c : {Case{0.5, 0.5, 0.5, 1 - 0.5 * 0.25 / std::pow(0.5, 1.5)}, Case{0.5, 1, 0, 0.75},
                        Case{0.3, 0.7, 0.4, 1 - 0.7 * 0.09 / std::pow(0.65, 1.5)}}) {
    const auto seen =
        floor_layers_at(c.x, ", " + sphere("black", fmt::format("[0, {}, 0]", c.height), c.radius), kColoredSky);
    expect_answer(seen[0], 0.5 * c.exact, 5e-3);
    expect_answer(seen[1], 2 * c.exact, 5e-3);
  }
}

TEST(AmbientOcclusion, ASphereLeavesTheVisibleShareOfTheSky) {
  // The same with `ao`, for any colours.
  struct Case {
    double radius, height, x, exact;
  };
  for (const Case& c : {Case{0.5, 0.5, 0.5, 0.6464466},
                        {0.5, 1, 0, 0.75},
                        {2, 3, 1.5, 1 - 3 * 4 / std::pow(11.25, 1.5)},
                        {0.3, 0.7, 0.4, 1 - 0.7 * 0.09 / std::pow(0.65, 1.5)}}) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [{0}, 0.001, 0], "look_at": [{0}, 0, 0], "up": [0, 0, 1])", c.x), 0.01, 8,
                 diffuse("white", 0.4),
                 plane_shape("white", "[0, 0, 0]", "[0, 1, 0]") +
                     also(sphere("white", fmt::format("[0, {}, 0]", c.height), c.radius))));
    const auto seen = [&](const std::string& method) { return mean_of(scene.render({method, 1, 0}, 12), 0); };
    expect_answer(seen("ao"), c.exact, 2e-3);
    // Just short of the sphere, and at a distance that includes all of it.
    EXPECT_EQ(seen(fmt::format("ao:distance={}", 0.9 * (std::hypot(c.x, c.height) - c.radius))).value, 1);
    expect_answer(seen(fmt::format("ao:distance={}", std::hypot(c.x, c.height) + c.radius)), c.exact, 2e-3);
  }
}

TEST(ShadowCatcher, SeesOnlyTheOuterSideOfClosedEmitters) {
  // A two-sided cube emitter, alone and with the sky. Its light on the floor has no shadow.
  std::string cube;
  for (int i = 0; i < 8; ++i) {
    cube += fmt::format("v {} {} {}\n", (i & 1) - 0.5, (i >> 1 & 1) + 1.0, (i >> 2 & 1) - 0.5);
  }
  cube += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  const auto scene =
      TestScene::from_text(document(R"("eye": [2.2, 0.3, 0.4], "look_at": [0.7, 0, 0.4])", 0.001, 8,
                                    std::string(kMaterials) +
                                        R"(, {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}},
                      "emission": {"rgb": [9, 9, 9]}, "two_sided_emission": true})",
                                    std::string(kFloor) + ", " + mesh("lamp", "cube.obj"), kColoredSky),
                           {{"cube.obj", cube}});
  // The emitter hides sky, and gives more light than that. The expected value without shadow is Lambert's formula for
  // its faces.
  const double shown = mean_of(scene.render({"path", 3, 0}, 10), 1).value;
  EXPECT_GT(shown, 2 * 0.9);
  EXPECT_LT(shown, 2);
}

/// The floor's value at (x, 0, 0) under a black two-sided emitter of this radiance, in a sky of radiance 0.1.
Estimate floor_under_emitter(double x, const std::string& emitter, double radiance, std::uint32_t level = 9) {
  const auto scene = TestScene::from_text(
      document(fmt::format(R"("eye": [{}, 0.3, 0], "look_at": [{}, 0, 0])", x + 0.9, x), 0.001, 8,
               fmt::format(R"({}, {{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {},
                              "two_sided_emission": true}})",
                           kMaterials, gray(0), gray(radiance)),
               std::string(kFloor) + ", " + mesh("lamp", "lamp.obj"),
               fmt::format(R"({{"environment": {{"radiance": {}}}}})", gray(0.1))),
      {{"lamp.obj", emitter}});
  return mean_of(scene.render({"path", 3, 0}, level), 0);
}

// The emitter hides only sky: of E = L_sky π + L E₁ without shadows, L_sky E₁ is missing.
double under_emitter(double unit_irradiance, double radiance) {
  const double whole = 0.1 * M_PI + radiance * unit_irradiance;
  return 0.1 * (1 - 0.1 * unit_irradiance / whole);
}

TEST(ShadowCatcher, TwoSidedPanelsCountInEitherWinding) {
  const std::string corners =
      "v -3 1 -1\nv -1 1 -1\nv -1 1 1\nv -3 1 1\nv 1 1 -1\nv 3 1 -1\nv 3 1 1\nv 1 1 1\nf 1 2 3 4\n";
  // A rectangle with a corner at height 1 (Lambert). Two of them give twice that.
  const auto corner = [](double a, double b) {
    const auto half = [](double s, double t) { return s / std::hypot(1, s) * std::atan(t / std::hypot(1, s)); };
    return 0.5 * (half(a, b) + half(b, a));
  };
  const double exact = under_emitter(4 * (corner(3, 1) - corner(1, 1)), 1);
  expect_answer(floor_under_emitter(0, corners + "f 5 6 7 8\n", 1), exact, 5e-3);
  expect_answer(floor_under_emitter(0, corners + "f 8 7 6 5\n", 1), exact, 5e-3);
}

TEST(ShadowCatcher, SeesTheInnerSideOfAnEmitterAroundIt) {
  // With either winding.
  const std::string corners = "v -5 -4 -5\nv 5 -4 -5\nv 5 -4 5\nv -5 -4 5\nv -5 6 -5\nv 5 6 -5\nv 5 6 5\nv -5 6 5\n";
  expect_answer(
      floor_under_emitter(1, corners + "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n", 1),
      0.1 / 1.1, 5e-3);
  expect_answer(
      floor_under_emitter(1, corners + "f 4 3 2 1\nf 5 6 7 8\nf 2 6 5 1\nf 3 7 6 2\nf 4 8 7 3\nf 1 5 8 4\n", 1),
      0.1 / 1.1, 5e-3);
}

/// A ball of quadrilaterals around (0, 1, 0), without this many of its upper rings.
std::string bulb(double radius, int without_rings) {
  constexpr int kRings = 8, kSegments = 16;
  std::string text;
  for (int i = 0; i <= kRings; ++i) {
    for (int j = 0; j < kSegments; ++j) {
      const double theta = M_PI * i / kRings, phi = 2 * M_PI * j / kSegments;
      text += fmt::format("v {} {} {}\n", radius * std::sin(theta) * std::cos(phi), 1 + radius * std::cos(theta),
                          radius * std::sin(theta) * std::sin(phi));
    }
  }
  for (int i = without_rings; i < kRings; ++i) {
    for (int j = 0; j < kSegments; ++j) {
      const int a = i * kSegments + j + 1, b = i * kSegments + (j + 1) % kSegments + 1;
      text += fmt::format("f {} {} {} {}\n", a, b, b + kSegments, a + kSegments);
    }
  }
  return text;
}

TEST(ShadowCatcher, AHoleOutOfViewChangesNothing) {
  // The value of a sphere, h R²/d³. The ball of facets is about 5 % smaller.
  const double x = 0.4, exact = under_emitter(M_PI * 0.09 / std::pow(1 + x * x, 1.5), 5);
  for (const int without_rings : {0, 1}) {
    const Estimate shown = floor_under_emitter(x, bulb(0.3, without_rings), 5, 6);
    EXPECT_NEAR(shown.value, exact, 5 * shown.standard_error + 0.1 * 5e-4) << without_rings;
    EXPECT_LT(shown.standard_error, 2e-2 * exact);
  }
}

TEST(ShadowCatcher, IgnoresLightThatTheSceneScatters) {
  const auto dark = floor_layers_at(0.5, ", " + sphere("black", "[0, 0.5, 0]", 0.5), kColoredSky, 7);
  const auto white = floor_layers_at(0.5, ", " + sphere("white", "[0, 0.5, 0]", 0.5), kColoredSky, 7);
  EXPECT_EQ(dark[1].value, white[1].value);
}

TEST(ShadowCatcher, IsDarkenedByTheShareOfEachLight) {
  // Without occlusion the sky gives 2π and the sun 3 cos 45°. A small distant ball shadows only the sun.
  const double sun = 3 * std::sqrt(0.5), sky = 2 * M_PI;
  for (const std::string method : {"path", "raycast"}) {
    const auto seen = floor_layers_at(
        0, ", " + sphere("black", "[-50, 50, 0]", 0.1),
        std::string(kColoredSky) + R"(, {"directional": {"direction": [1, -1, 0], "irradiance": {"rgb": [3, 3, 3]}}})",
        9, method);
    expect_answer(seen[1], 2 * sky / (sky + sun), 1e-2);
  }
}

TEST(ShadowCatcher, ShowsTheBackgroundUnchangedWithoutLight) {
  // Its back receives nothing from a light above.
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, -1, 0.1], "look_at": [0, 0, 0])", 0.01, 8, kMaterials, kFloor,
                                    R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, 1, 1]}}})"));
  EXPECT_EQ(mean_of(scene.render({"path", 3, 1}, 3), 0).value, 0);
}

TEST(ShadowCatcher, ObjectsSeeTheBackgroundInIt) {
  // A white sphere over an unshadowed, uniform background would show 1 times the sky. Its own shadow lowers this.
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 50, 0.1], "look_at": [0, 40, 0])", 0.001, 8, kMaterials,
                                    std::string(kFloor) + ", " + sphere("white", "[0, 40, 0]", 0.5), kColoredSky));
  const Estimate top = mean_of(scene.render({"path", 3, 0}, 8), 1);
  expect_answer(top, 2, 1e-2);
}

TEST(ShadowCatcher, RefusesEmissionThatItCannotCompare) {
  Scene scene = TestScene::from_text(document(R"("eye": [0, 1, 0], "look_at": [0, 0, 0.1])", 30, 8, kMaterials,
                                              std::string(kFloor) + ", " + sphere("black", "[0, 1, 0]", 0.1)))
                    .scene();
  EXPECT_TRUE(validate(scene).ok());
  scene.materials[1].emission = {1, 1, 1};
  EXPECT_TRUE(validate(scene).ok());
  scene.materials[1].emission_exponent = 2;
  EXPECT_EQ(message_of(validate(scene)),
            "materials[1].emission_exponent: \"black\", of objects[1], emits with an exponent, which is not possible "
            "in a scene with a shadow catcher (objects[0])");
  scene.materials[0].emission = {1, 1, 1};
  EXPECT_EQ(message_of(validate(scene)), "materials[0].emission: a shadow catcher cannot emit light");
}

}  // namespace
}  // namespace lightmill::test
