// `raycast` against numbers worked out by hand, through public scene documents.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

using Files = std::map<std::string, std::string>;

/// Red value of a point of a scene, seen by a camera with a tiny field of view. The halves are equal up to the
/// variation over the pixel.
double seen(const std::string& view, const std::string& materials, const std::string& objects,
            const std::string& lights, const Files& files = {}, const std::string& method = "raycast",
            std::uint32_t max_bounces = 0) {
  const auto scene = TestScene::from_text(document(view, 0.01, 8, materials, objects, lights), files);
  const Estimate value = mean_of(scene.render({method, 1, max_bounces}, 1), 0);
  EXPECT_LE(value.standard_error, 1e-4 * value.value) << "not one value";
  return value.value;
}

std::string above(double x, double z = 0) {
  return fmt::format(R"("eye": [{0}, 0.5, {2}], "look_at": [{0}, 0, {1}])", x, z, z + 0.01);
}

/// Irradiance of a floor (y = 0, white on both sides) at (x, 0, z).
double floor_irradiance(double x, const std::string& lights, const std::string& more_objects = "",
                        const std::string& more_materials = "", const Files& more_files = {}, double z = 0) {
  Files files = more_files;
  files["floor.obj"] = plane(40, 0, true);
  return M_PI * seen(above(x, z), diffuse("floor", 1) + more_materials, mesh("floor", "floor.obj") + more_objects,
                     lights, files);
}

void expect_near(double value, double exact) {
  EXPECT_NEAR(value, exact, 5 * kRounding * exact);
}

const char* const kPoint = R"({"point": {"position": [0, 2, 0], "intensity": {"rgb": [6, 6, 6]}}})";

TEST(Raycast, APointGivesIntensityTimesCosineOverSquaredDistance) {
  expect_near(floor_irradiance(0, kPoint), 1.5);
  expect_near(floor_irradiance(1.5, kPoint), 6 * 0.8 / 6.25);
  expect_near(floor_irradiance(-8, kPoint), 6 * 2 / std::pow(68, 1.5));
}

TEST(Raycast, AHardShadowEndsWhereGeometrySays) {
  // A card at half the light's height that ends at x = 0.5: its shadow ends at x = 1.
  const std::string card = also(mesh("floor", "card.obj"));
  const Files files{{"card.obj", horizontal_rectangle(-3, 0.5, -1, 1.5, 1, false)}};
  EXPECT_EQ(floor_irradiance(0.9998, kPoint, card, "", files), 0);
  expect_near(floor_irradiance(1.0002, kPoint, card, "", files), 6 * 2 / std::pow(4 + 1.0002 * 1.0002, 1.5));
}

TEST(Raycast, DirectionalSpotAndCosinePowerAreExact) {
  expect_near(floor_irradiance(3, R"({"directional": {"direction": [3, -4, 0], "irradiance": {"rgb": [7, 7, 7]}}})"),
              7 * 0.8);
  const auto spot = [](double x) {
    return floor_irradiance(x, R"({"spot": {"position": [0, 2, 0], "direction": [0, -1, 0], "cutoff_degrees": 45,
                                    "intensity": {"rgb": [6, 6, 6]}}})");
  };
  expect_near(spot(1.98), 6 * 2 / std::pow(4 + 1.98 * 1.98, 1.5));
  EXPECT_EQ(spot(2.02), 0);
  expect_near(floor_irradiance(1.5, R"({"cosine_power": {"position": [0, 2, 0], "direction": [0, -1, 0],
                                         "intensity": {"rgb": [6, 6, 6]}, "exponent": 3}})"),
              6 * std::pow(0.8, 4) / 6.25);
}

TEST(Raycast, LightsAddUp) {
  const std::string sun = R"({"directional": {"direction": [0, -1, 0], "irradiance": {"rgb": [2, 2, 2]}}})";
  const std::string emitter = also(sphere("lamp", "[1.5, 2, 0]", 0.5));
  expect_near(floor_irradiance(1.5, kPoint + also(kPoint) + also(sun), emitter, also(diffuse("lamp", 0, 3))),
              2 * 6 * 0.8 / 6.25 + 0 /* the sun is behind the lamp */ + 3 * M_PI * 0.25 / 4);
}

TEST(AreaLight, ShinesFromTheMiddleOfItsBoxWithItsPower) {
  // 0.4 × 0.6, L = 5: Φ = 1.2π, so 1.2 along the normal, falling off with the cosine.
  const Files files{{"lamp.obj", horizontal_rectangle(0.8, 1.2, -0.3, 0.3, 2, false)}};
  const std::string emitter = also(mesh("lamp", "lamp.obj"));
  expect_near(floor_irradiance(1, "", emitter, also(diffuse("lamp", 0, 5)), files), 0.3);
  expect_near(floor_irradiance(2.5, "", emitter, also(diffuse("lamp", 0, 5)), files), 1.2 * 0.8 * 0.8 / 6.25);
  // The same by power. With L = L₀ cos²θ the intensity along the normal is Φ/(2π/4).
  const auto watt = [](double flux, int exponent) {
    return fmt::format(R"(, {{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission_strength": {{"watt": {}}},
                            "emission_exponent": {}}})",
                       gray(0), flux, exponent);
  };
  expect_near(floor_irradiance(2.5, "", emitter, watt(1.2 * M_PI, 0), files), 1.2 * 0.8 * 0.8 / 6.25);
  expect_near(floor_irradiance(2.5, "", emitter, watt(M_PI, 2), files), 2 * std::pow(0.8, 4) / 6.25);
}

TEST(AreaLight, ShinesOnTheSidesThatEmit) {
  const auto lit = [](bool up, const std::string& sides) {
    return floor_irradiance(0, "", also(mesh("lamp", "lamp.obj")),
                            fmt::format(R"(, {{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {}{}}})",
                                        gray(0), gray(4), sides),
                            {{"lamp.obj", horizontal_square(0.5, 2, up)}});
  };
  expect_near(lit(false, ""), 0.25);
  EXPECT_EQ(lit(true, ""), 0);
  expect_near(lit(true, R"(, "two_sided_emission": true)"), 0.25);
  expect_near(lit(false, R"(, "two_sided_emission": true)"), 0.25);
}

TEST(AreaLight, IgnoresTheWindingWhenTwoSided) {
  const std::string corners =
      "v -3 1 -1\nv -1 1 -1\nv -1 1 1\nv -3 1 1\nv 1 1 -1\nv 3 1 -1\nv 3 1 1\nv 1 1 1\nf 1 2 3 4\n";
  const auto lit = [](const std::string& obj) {
    return floor_irradiance(0, "", also(mesh("lamp", "lamp.obj")),
                            fmt::format(R"(, {{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {},
                                            "two_sided_emission": true}})",
                                        gray(0), gray(1)),
                            {{"lamp.obj", obj}});
  };
  // Two panels of area 4: A L along the normal of both.
  expect_near(lit(corners + "f 5 6 7 8\n"), 8);
  expect_near(lit(corners + "f 8 7 6 5\n"), 8);
  // Four upright panels around the middle, open above and below: A = 16 on two sides, the same in all directions.
  const std::string tube =
      "v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\nv -1 4 -1\nv 1 4 -1\nv 1 4 1\nv -1 4 1\n"
      "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  expect_near(lit(tube), 2 * 16.0 / 4 / 9);
  // With both ends it shines only by its outer side.
  expect_near(lit(tube + "f 4 3 2 1\nf 5 6 7 8\n"), 24.0 / 4 / 9);
}

TEST(AreaLight, TriangleShinesFromTheMiddleOfItsBox) {
  // Half of a 2 × 2 square. The middle of its box is on its longest side.
  const std::string triangle =
      R"(, {"material": "lamp", "triangle": {"a": [0, 2, 0], "b": [2, 2, 0], "c": [0, 2, 2]}})";
  expect_near(floor_irradiance(1, "", triangle, also(diffuse("lamp", 0, 3)), {}, 1), 6.0 / 4);
  expect_near(floor_irradiance(-0.5, "", triangle, also(diffuse("lamp", 0, 3)), {}, 1), 6 * 0.64 / 6.25);
}

TEST(AreaLight, SphereOrClosedMeshShinesAlikeInAllDirections) {
  // A sphere: L π r². It does not occlude its own middle.
  const std::string ball = also(sphere("lamp", "[0, 2, 0]", 0.5));
  expect_near(floor_irradiance(1.5, "", ball, also(diffuse("lamp", 0, 3))), 3 * M_PI * 0.25 * 0.8 / 6.25);
  // A cube with sides of 1: Φ = 6 π L, Φ/4π = 1.5 L.
  const Files files{{"cube.obj",
                     "v -0.5 1.5 -0.5\nv 0.5 1.5 -0.5\nv 0.5 1.5 0.5\nv -0.5 1.5 0.5\n"
                     "v -0.5 2.5 -0.5\nv 0.5 2.5 -0.5\nv 0.5 2.5 0.5\nv -0.5 2.5 0.5\n"
                     "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"}};
  expect_near(floor_irradiance(1.5, "", also(mesh("lamp", "cube.obj")), also(diffuse("lamp", 0, 2)), files),
              3 * 0.8 / 6.25);
}

TEST(AreaLight, CurvedMeshShinesAboutItsMeanNormal) {
  // Two unit squares that meet at the bottom, 45° to the horizontal: A = 2, mean normal straight down.
  const double s = std::sqrt(0.5);
  const Files files{{"roof.obj", fmt::format("v 0 2 -0.5\nv 0 2 0.5\nv {0} {1} 0.5\nv {0} {1} -0.5\nv -{0} {1} 0.5\n"
                                             "v -{0} {1} -0.5\nf 4 3 2 1\nf 1 2 5 6\n",
                                             s, 2 + s)}};
  const double height = 2 + s / 2, d2 = height * height + 1;
  expect_near(floor_irradiance(1, "", also(mesh("lamp", "roof.obj")), also(diffuse("lamp", 0, 3)), files),
              6 * height * height / (d2 * d2));
}

TEST(AreaLight, IsHiddenByOccluders) {
  const std::string emitter = also(sphere("lamp", "[0, 4, 0]", 0.5)), ball = also(sphere("floor", "[0, 2, 0]", 0.25));
  const auto lit = [&](double x) { return floor_irradiance(x, "", emitter + ball, also(diffuse("lamp", 0, 1))); };
  // Seen from the light's middle, 2 above the ball's, the ball hides a cone with sine 1/8: at the floor tan · 4.
  const double edge = 4 / std::sqrt(63);
  EXPECT_EQ(lit(edge - 2e-4), 0);
  const double x = edge + 2e-4;
  expect_near(lit(x), M_PI * 0.25 * 4 / std::pow(16 + x * x, 1.5));
}

TEST(AreaLight, ShowsItsRadianceAndDoesNotLightItself) {
  const std::string view = R"("eye": [0.2, 0, 0.1], "look_at": [0.2, 2, 0.1], "up": [0, 0, 1])";
  const auto looks = [&](bool up) {
    return seen(view, diffuse("lamp", 0.9, 5), mesh("lamp", "lamp.obj"), "",
                {{"lamp.obj", horizontal_square(1, 2, up)}});
  };
  expect_near(looks(false), 5);
  EXPECT_EQ(looks(true), 0);
}

/// A regular octahedron, smooth as a sphere.
const char* const kOctahedron =
    "v 1 0 0\nv 0 1 0\nv 0 0 1\nv -1 0 0\nv 0 -1 0\nv 0 0 -1\n"
    "vn 1 0 0\nvn 0 1 0\nvn 0 0 1\nvn -1 0 0\nvn 0 -1 0\nvn 0 0 -1\n"
    "f 1//1 2//2 3//3\nf 2//2 4//4 3//3\nf 4//4 5//5 3//3\nf 5//5 1//1 3//3\n"
    "f 2//2 1//1 6//6\nf 4//4 2//2 6//6\nf 5//5 4//4 6//6\nf 1//1 5//5 6//6\n";

TEST(Raycast, NormalsAreSmoothOrFlat) {
  // The normals of the corners are the corners, so the interpolated normal points away from the middle.
  const auto at = [](const std::string& method) {
    return M_PI * seen(R"("eye": [1.2, 0.6, 0.2], "look_at": [0.6, 0.3, 0.1])", diffuse("clay", 1),
                       mesh("clay", "octahedron.obj"),
                       R"({"directional": {"direction": [-1, 0, 0], "irradiance": {"rgb": [2, 2, 2]}}})",
                       {{"octahedron.obj", kOctahedron}}, method);
  };
  expect_near(at("raycast"), 2 * 0.6 / std::sqrt(0.46));
  expect_near(at("raycast:flat"), 2 / std::sqrt(3));
}

// With a point light next-event estimation has no choice. So one scattering in `path` is also exact.
TEST(Raycast, EveryMaterialScattersAsInThePathTracer) {
  const std::string light = R"({"point": {"position": [1.1, 1.3, -0.7], "intensity": {"rgb": [6, 5, 4]}}})";
  const std::string beyond = R"({"point": {"position": [0.3, -1.5, -0.2], "intensity": {"rgb": [6, 5, 4]}}})";
  struct Case {
    const char* kind;
    bool transmits;
  };
  for (const Case& shown :
       {Case{R"("phong": {"diffuse": {"rgb": [0.3, 0.4, 0.5]}, "specular": {"rgb": [0.5, 0.4, 0.3]}, "exponent": 7})",
             false},
        Case{R"("conductor": {"metal": "copper", "roughness": 0.6})", false},
        Case{R"("dielectric": {"ior": 1.4, "roughness": 0.7})", true},
        Case{R"("principled": {"base_color": {"rgb": [0.8, 0.5, 0.3]}, "metallic": 0.4, "coat": 0.5,
                 "coat_roughness": 0.3})",
             false},
        Case{R"("principled": {"base_color": {"rgb": [0.8, 0.5, 0.3]}, "transmission": 0.8, "roughness": 0.8})",
             true}}) {
    const std::string material = fmt::format(R"({{"name": "shown", {}}})", shown.kind);
    for (const std::string& emitter : {light, beyond}) {
      const auto by = [&](const std::string& method) {
        return seen(R"("eye": [-1, 1, 0.3], "look_at": [0, 0, 0])", material, mesh("shown", "floor.obj"), emitter,
                    {{"floor.obj", plane(4, 0, true)}}, method, 1);
      };
      const double by_path = by("path");
      EXPECT_NEAR(by("raycast"), by_path, 1e-5 * by_path) << material << emitter;
      EXPECT_EQ(by_path > 1e-3, shown.transmits || emitter == light) << material << emitter << by_path;
    }
  }
}

TEST(Raycast, MirrorsAndSmoothGlassAreBlack) {
  const std::string sky = R"({"environment": {"radiance": {"rgb": [0.6, 0.6, 0.6]}}})";
  for (const char* const kind :
       {R"("mirror": {})", R"("dielectric": {})", R"("conductor": {"metal": "gold"})",
        R"("principled": {"metallic": 1, "roughness": 0})", R"("principled": {"transmission": 1, "roughness": 0})",
        R"("principled": {"base_color": {"rgb": [0, 0, 0]}, "roughness": 0, "coat": 1,
                                                   "coat_roughness": 0})"}) {
    EXPECT_EQ(seen(above(0), fmt::format(R"({{"name": "shiny", {}}})", kind), sphere("shiny", "[0, -1, 0]", 1),
                   kPoint + also(sky)),
              0)
        << kind;
  }
}

TEST(Raycast, TheEnvironmentIsSeenAndLightsEvenly) {
  const std::string sky = R"({"environment": {"radiance": {"rgb": [0.6, 0.6, 0.6]}, "scale": 2}})";
  expect_near(floor_irradiance(0, sky), 1.2 * M_PI);
  expect_near(floor_irradiance(1.5, sky + also(kPoint)), 1.2 * M_PI + 6 * 0.8 / 6.25);
  const std::string lacquer =
      R"({"name": "lacquer", "phong": {"diffuse": {"rgb": [0.3, 0.4, 0.5]}, "specular": {"rgb": [0.5, 0.4, 0.3]}}})";
  expect_near(seen(above(0), lacquer, sphere("lacquer", "[0, -1, 0]", 1), sky), 0.8 * 1.2);
  expect_near(seen(R"("eye": [0, 3, 0], "look_at": [0, 3, 1])", lacquer, sphere("lacquer", "[0, -1, 0]", 1), sky), 1.2);
}

TEST(Raycast, LightIsAbsorbedWhereItGoesStraightOn) {
  // A slab of smoke, 0.5 thick, between the light and the floor, and between the floor and the camera. Light crosses it
  // at a cosine of 0.8. The camera looks straight down (to 0.01 in 2.5).
  const std::string slab =
      "v -9 1 -9\nv 9 1 -9\nv 9 1 9\nv -9 1 9\nv -9 1.5 -9\nv 9 1.5 -9\nv 9 1.5 9\nv -9 1.5 9\n"
      "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
  const Files files{{"slab.obj", slab}, {"floor.obj", plane(40, 0, true)}};
  const auto shown = [&](double ior, const std::string& emitter, const std::string& lights) {
    const std::string medium = fmt::format(
        R"(, {{"name": "smoke", "dielectric": {{"ior": {}}}, "interior": {{"absorption": {}}}}})", ior, gray(0.7));
    return M_PI * seen(R"("eye": [1.5, 2.5, 0.01], "look_at": [1.5, 0, 0])",
                       diffuse("floor", 1) + medium + also(diffuse("lamp", 0, 3)),
                       mesh("floor", "floor.obj") + also(mesh("smoke", "slab.obj")) + emitter, lights, files);
  };
  const double left = std::exp(-0.7 * 0.5 / 0.8) * std::exp(-0.7 * 0.5);
  EXPECT_NEAR(shown(1, "", kPoint), 6 * 0.8 / 6.25 * left, 1e-4);
  EXPECT_NEAR(shown(1, also(sphere("lamp", "[0, 2, 0]", 0.1)), ""), 3 * M_PI * 0.01 * 0.8 / 6.25 * left, 1e-5);
  EXPECT_EQ(shown(1.5, "", kPoint), 0);  // glass itself is black
}

}  // namespace
}  // namespace lightmill::test
