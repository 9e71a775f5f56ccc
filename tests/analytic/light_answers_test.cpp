// Lights of every kind, and their units, through public scene documents.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// Value of a white floor (y = 0) at (x, 0, 0), seen from straight above, with more objects and materials.
Estimate floor_at(double x, const std::string& lights, const std::string& more_objects = "",
                  const std::string& more_materials = "", std::uint32_t level = 6,
                  const std::map<std::string, std::string>& more_files = {}) {
  std::map<std::string, std::string> files = more_files;
  files["floor.obj"] = plane(40, 0, true);
  const auto scene = TestScene::from_text(
      document(fmt::format(R"("eye": [{0}, 0.5, 0.01], "look_at": [{0}, 0, 0])", x), 0.01, 8,
               diffuse("floor", 1) + more_materials, mesh("floor", "floor.obj") + more_objects, lights),
      files);
  return mean_of(scene.render({"path", 3, 1}, level), 0);
}

/// A white floor of irradiance E shows E/π. Point lights leave no noise.
void expect_irradiance(const Estimate& floor, double irradiance) {
  EXPECT_NEAR(floor.value, irradiance / M_PI, 3 * kRounding * irradiance + 5 * floor.standard_error);
  EXPECT_LE(floor.standard_error, 1e-5 * irradiance);
}

TEST(DirectionalLight, IrradianceFollowsTheCosine) {
  for (const double degrees : {0.0, 30.0, 60.0, 85.0}) {
    const double theta = degrees * M_PI / 180;
    const std::string sun =
        fmt::format(R"({{"directional": {{"direction": [{}, {}, 0], "irradiance": {{"rgb": [7, 7, 7]}}}}}})",
                    3 * std::sin(theta), -3 * std::cos(theta));
    expect_irradiance(floor_at(0.3, sun), 7 * std::cos(theta));
  }
  // Light from below does not pass.
  EXPECT_EQ(floor_at(0, R"({"directional": {"direction": [0, 1, 0], "irradiance": {"rgb": [7, 7, 7]}}})").value, 0);
}

TEST(DirectionalLight, FarObjectsCastShadows) {
  const auto lit = [](double center) {
    return floor_at(
               0, R"({"directional": {"direction": [0, -1, 0]}, "strength": {"lux": 683}})",
               fmt::format(R"(, {{"material": "floor", "sphere": {{"center": [0, {}, 0], "radius": 10}}}})", center))
        .value;
  };
  EXPECT_EQ(lit(1e5), 0);
}

TEST(SpotLight, IsFullWithinSmoothBetweenAndDarkOutside) {
  // Straight down from height 2: a cone of 45°, and falloff in its outer 60 %.
  const std::string spot =
      R"({"spot": {"position": [0, 2, 0], "direction": [0, -5, 0], "intensity": {"rgb": [6, 6, 6]},
          "cutoff_degrees": 45, "blend": 0.6}})";
  const double inner = std::cos(18 * M_PI / 180), outer = std::cos(45 * M_PI / 180);
  for (const double x : {0.0, 0.5, 0.8, 1.2, 1.7, 1.95}) {
    const double d2 = 4 + x * x, cosine = 2 / std::sqrt(d2);
    const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
    expect_irradiance(floor_at(x, spot), 6 * t * t * (3 - 2 * t) * cosine / d2);
  }
  EXPECT_EQ(floor_at(2.1, spot).value, 0);
  // Without blending the rim is sharp.
  const std::string sharp =
      R"({"spot": {"position": [0, 2, 0], "direction": [0, -1, 0], "intensity": {"rgb": [6, 6, 6]}}})";
  expect_irradiance(floor_at(1.98, sharp), 6 * 2 / std::pow(4 + 1.98 * 1.98, 1.5));
  EXPECT_EQ(floor_at(2.02, sharp).value, 0);
}

TEST(SpotLight, NarrowConesKeepTheirFlux) {
  // 1 W into cones of 1° to 0.001°. All of it reaches a disc of the floor below, which the camera sees completely.
  for (const double cutoff : {1.0, 0.1, 0.01, 0.001}) {
    const double radius = 2 * std::tan(cutoff * M_PI / 180);
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 1, 0.0001], "look_at": [0, 0, 0])", 2 * std::atan(1.5 * radius) * 180 / M_PI, 32,
                 diffuse("floor", 1), mesh("floor", "floor.obj"),
                 fmt::format(R"({{"spot": {{"position": [0, 2, 0], "direction": [0, -1, 0], "cutoff_degrees": {},
                     "blend": 0.5}}, "strength": {{"watt": 1}}}})",
                             cutoff)),
        {{"floor.obj", plane(4, 0, true)}});
    const Estimate mean = mean_of(scene.render({"path", 3, 1}, 8), 0);
    const double area = 9 * radius * radius;
    EXPECT_NEAR(mean.value * M_PI * area, 1, 5e-3 + 5 * mean.standard_error * M_PI * area) << cutoff;
  }
}

TEST(CosinePowerLight, FallsOffWithThePowerOfTheCosine) {
  for (const double n : {0.0, 1.0, 4.5, 300.0}) {
    const std::string light = fmt::format(
        R"({{"cosine_power": {{"position": [0, 2, 0], "direction": [0, -1, 0], "intensity": {{"rgb": [6, 6, 6]}},
            "exponent": {}}}}})",
        n);
    for (const double x : {0.0, 0.7, 2.5}) {
      const double d2 = 4 + x * x, cosine = 2 / std::sqrt(d2);
      const double exact = 6 * std::pow(cosine, n + 1) / d2;
      const Estimate seen = floor_at(x, light);
      // The cosine is known to 1e-7, and its power to n times that.
      EXPECT_NEAR(seen.value, exact / M_PI, (3 * kRounding + 3e-7 * n) * exact + 1e-30) << n << ' ' << x;
    }
  }
  EXPECT_EQ(floor_at(0, R"({"cosine_power": {"position": [0, 2, 0], "direction": [0, 1, 0], "exponent": 0,
                            "intensity": {"rgb": [6, 6, 6]}}})")
                .value,
            0);
}

TEST(IesLight, HasTheIntensitiesOfItsFile) {
  const std::string file =
      "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 3 1 2 0 0 0\n1 1 10\n0 45 90\n0 90 180\n"
      "1000 800 0\n1000 400 0\n1000 200 0\n";
  const std::map<std::string, std::string> files{{"lamp.ies", file}};
  const std::string light = R"({"ies": {"position": [0, 1, 0], "file": "lamp.ies", "scale": 683}})";
  // Horizontal angle 0 is towards +x, and 180 towards −x.
  expect_irradiance(floor_at(0, light, "", "", 6, files), 1000);
  expect_irradiance(floor_at(1, light, "", "", 6, files), 800 / std::pow(2, 1.5));
  expect_irradiance(floor_at(-1, light, "", "", 6, files), 200 / std::pow(2, 1.5));
  const double x = std::tan(30 * M_PI / 180), d2 = 1 + x * x;
  expect_irradiance(floor_at(x, light, "", "", 6, files), (1000 - 200 * 30 / 45.0) / std::pow(d2, 1.5));
  // Turned about the vertical: +x is at horizontal angle 90.
  const std::string turned = R"({"ies": {"position": [0, 1, 0], "up": [0, 3, 1], "file": "lamp.ies", "scale": 683}})";
  expect_irradiance(floor_at(1, turned, "", "", 6, files), 400 / std::pow(2, 1.5));
}

TEST(Environment, AConstantOneGivesAWhiteFloorItsRadiance) {
  // E = πL, all found by scattered rays.
  const Estimate floor = floor_at(0, R"({"environment": {"radiance": {"rgb": [0.6, 0.6, 0.6]}, "scale": 2}})");
  expect_irradiance(floor, 1.2 * M_PI);
}

TEST(Environment, IsSeenBehindAndInMirrors) {
  // A mirror ball in the middle. The radiance is the same in all directions.
  const auto scene = TestScene::from_text(document(
      R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 60, 32, R"({"name": "silver", "mirror": {}})",
      sphere("silver", "[0, 0, 0]", 1), R"({"environment": {}, "strength": {"candela_per_square_metre": 1366}})"));
  const HalfImages image = scene.render({"path", 1, 0}, 2);
  for (const double value : image.a) {
    ASSERT_NEAR(value, 2, 1e-6);
  }
}

TEST(Environment, IsThePreviewsBackground) {
  const auto scene = TestScene::from_text(document(R"("eye": [0, 0, 3], "look_at": [0, 9, 3], "up": [0, 0, 1])", 20, 8,
                                                   diffuse("grey", 0.5), sphere("grey", "[0, 0, 0]", 1),
                                                   R"({"environment": {"radiance": {"rgb": [0.25, 0.5, 0.75]}}})"));
  const HalfImages image = scene.render({"preview", 1, 0}, 1);
  EXPECT_NEAR(image.a[0], 0.25, 1e-6);
  EXPECT_NEAR(image.a[1], 0.5, 1e-6);
  EXPECT_NEAR(image.a[2], 0.75, 1e-6);
}

TEST(Lights, SeveralAtOnceAddUp) {
  const std::string point = R"({"point": {"position": [1, 2, 0], "intensity": {"rgb": [3, 3, 3]}}})";
  const std::string sun = R"({"directional": {"direction": [1, -1, 0], "irradiance": {"rgb": [0.5, 0.5, 0.5]}}})";
  const std::string sky = R"({"environment": {"radiance": {"rgb": [0.2, 0.2, 0.2]}}})";
  const std::string emitter = also(sphere("lamp", "[-1, 3, 0]", 0.5));
  const double of_point = 3 * 2 / std::pow(5, 1.5), of_sun = 0.5 / std::sqrt(2);
  const double of_emitter = M_PI * 4 * 0.25 / 10 * 3 / std::sqrt(10);
  const double of_sky = 0.2 * (M_PI - M_PI * 0.25 / 10 * 3 / std::sqrt(10));  // the emitter hides a part of the sky
  const Estimate floor = floor_at(0, point + also(sun) + also(sky), emitter, also(diffuse("lamp", 0, 4)), 12);
  expect_answer(floor, (of_point + of_sun + of_emitter + of_sky) / M_PI, 3e-3);
}

TEST(Units, ConvertForPointsSpotsAndCosinePowers) {
  const std::string point = R"("point": {"position": [0, 2, 0]})";
  const auto one = [&](const std::string& kind, const std::string& strength) {
    return floor_at(0, fmt::format("{{{}, \"strength\": {{{}}}}}", kind, strength));
  };
  expect_irradiance(one(point, R"("watt": 1.68)"), 0.13369 / 4);
  expect_irradiance(one(point, R"("lumen": 800)"), 800 / 683.0 / (4 * M_PI) / 4);
  expect_irradiance(one(point, R"("candela": 683)"), 0.25);
  expect_irradiance(one(point, R"("watt_per_steradian": 3)"), 0.75);
  const std::string cone = R"("spot": {"position": [0, 2, 0], "direction": [0, -1, 0], "cutoff_degrees": 60})";
  expect_irradiance(one(cone, R"("watt": 10)"), 10 / (2 * M_PI * 0.5) / 4);
  expect_irradiance(one(cone, R"("candela": 683)"), 0.25);
  const std::string cosine = R"("cosine_power": {"position": [0, 2, 0], "direction": [0, -1, 0], "exponent": 3})";
  expect_irradiance(one(cosine, R"("lumen": 683)"), 4 / (2 * M_PI) / 4);
  // Only the ratio of the colour's channels counts. The strength sets the luminance.
  const auto scene = TestScene::from_text(document(R"("eye": [0, 0.5, 0.01], "look_at": [0, 0, 0])", 0.01, 8,
                                                   diffuse("floor", 1), mesh("floor", "floor.obj"),
                                                   R"({"directional": {"direction": [0, -1, 0]},
          "strength": {"lux": 683, "color": {"rgb": [8, 4, 2]}}})"),
                                          {{"floor.obj", plane(40, 0, true)}});
  const HalfImages image = scene.render({"path", 3, 1}, 2);
  EXPECT_NEAR(0.2126 * image.a[0] + 0.7152 * image.a[1] + 0.0722 * image.a[2], 1 / M_PI, 1e-5);
  EXPECT_NEAR(image.a[0] / image.a[1], 2, 1e-5);
  EXPECT_NEAR(image.a[1] / image.a[2], 2, 1e-5);
}

/// Radiance of an emitter at (0, 0, 0), seen at this angle to its normal.
double emitter_seen(const std::string& emission, double degrees, const std::string& shape,
                    const std::map<std::string, std::string>& files) {
  const double theta = degrees * M_PI / 180;
  const auto scene = TestScene::from_text(
      document(fmt::format(R"("eye": [{}, {}, 0], "look_at": [0, 0, 0], "up": [0, 0, 1])", 3 * std::sin(theta),
                           3 * std::cos(theta)),
               0.01, 8, fmt::format(R"({{"name": "lamp", "diffuse": {{"reflectance": {}}}, {}}})", gray(0), emission),
               shape),
      files);
  return mean_of(scene.render({"path", 1, 0}, 2), 0).value;
}

TEST(Units, ConvertForEmissiveSurfaces) {
  const std::map<std::string, std::string> quad{{"quad.obj", horizontal_rectangle(-0.04, 0.06, -0.06, 0.04, 0, true)}};
  const auto quad_seen = [&](const std::string& emission, double degrees) {
    return emitter_seen(emission, degrees, mesh("lamp", "quad.obj"), quad);
  };
  // 0.1 × 0.1, L = 5000: 157.080 W, 15708 W/m².
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"watt": 157.080})", 50), 5000, 0.05);
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"watt_per_square_metre": 15707.963})", 20), 5000, 0.01);
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"lumen": 107285.4})", 0), 5000, 0.5);
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"candela_per_square_metre": 3415000})", 0), 5000, 0.01);
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"watt": 314.159}, "two_sided_emission": true)", 0), 5000, 0.05);
  // L = 6000 cosθ: 125.664 W.
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"watt": 125.664}, "emission_exponent": 1)", 0), 6000, 0.05);
  EXPECT_NEAR(quad_seen(R"("emission_strength": {"watt": 125.664}, "emission_exponent": 1)", 60), 3000, 0.05);
  EXPECT_NEAR(quad_seen(R"("emission_flux": {"rgb": [125.664, 0, 0]}, "emission_exponent": 1)", 0), 6000, 0.05);
  // A sphere of diameter 1 cm with 1.68 W: 5347.6 W/m².
  const std::string bulb = R"({"material": "lamp", "sphere": {"center": [0, -0.005, 0], "radius": 0.005}})";
  EXPECT_NEAR(emitter_seen(R"("emission_strength": {"watt": 1.68})", 0, bulb, {}) * M_PI, 5347.6, 0.1);
  // Two such bulbs of one material share its power.
  const std::string two = bulb + R"(, {"material": "lamp", "sphere": {"center": [5, 0, 0], "radius": 0.005}})";
  EXPECT_NEAR(emitter_seen(R"("emission_strength": {"watt": 3.36})", 0, two, {}) * M_PI, 5347.6, 0.1);
}

// A ray finds one of two coincident emitters, so light sampling must also draw only one.
TEST(EmissiveSurfaces, CountOnceInOnePlaceWhateverTheirMaterials) {
  const std::string sides = R"(, "two_sided_emission": true)";
  const auto emitter = [&](const std::string& name) {
    return fmt::format(R"({{"name": "{}", "diffuse": {{"reflectance": {}}}, "emission": {}{}}})", name, gray(0),
                       gray(2), sides);
  };
  const std::string square = horizontal_square(1, 1, false), turned = horizontal_square(1, 1, true);
  const double exact = 2 * 4 * (0.5 / std::hypot(1, 0.5)) * std::atan(0.5 / std::hypot(1, 0.5));
  const std::string ball = R"("sphere": {"center": [0, 1, 0], "radius": 0.5})";
  const auto read = [&](const std::string& objects) {
    const auto scene = scene_with(fmt::format(R"("materials": [{}, {}], "objects": [{}],
            "meters": [{{"name": "m", "irradiance": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}])",
                                              emitter("lamp"), emitter("other"), objects),
                                  {{"square.obj", square}, {"turned.obj", turned}});
    return read_meters(scene, 4)[0];
  };
  expect_reading(read(mesh("lamp", "square.obj") + ", " + mesh("other", "square.obj")), exact, 2e-2);
  expect_reading(read(mesh("lamp", "square.obj") + ", " + mesh("other", "turned.obj")), exact, 2e-2);
  expect_reading(read(fmt::format(R"({{"material": "lamp", {0}}}, {{"material": "other", {0}}})", ball)),
                 2 * M_PI * 0.25, 2e-2);
}

TEST(CosineProfile, IrradianceIsTheIntegralOverTheEmitter) {
  // A 1 × 1 emitter at height 1 with L = 3 cos^n: E on the floor below its centre, by the midpoint rule.
  for (const double n : {1.0, 8.0}) {
    double irradiance = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double x = (i + 0.5) / kSteps - 0.5, z = (j + 0.5) / kSteps - 0.5;
        irradiance += 3 * std::pow(1 + x * x + z * z, -(n + 4) / 2);
      }
    }
    irradiance /= kSteps * kSteps;
    const Estimate floor = floor_at(
        0, "", also(mesh("lamp", "lamp.obj")),
        fmt::format(
            R"(, {{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {}, "emission_exponent": {}}})",
            gray(0), gray(3), n),
        12, {{"lamp.obj", horizontal_square(1, 1, false)}});
    expect_answer(floor, irradiance / M_PI, 2e-3);
  }
}

}  // namespace
}  // namespace lightmill::test
