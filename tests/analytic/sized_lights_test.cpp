// Lights with a size, through public scene documents: suns, spheres, spots, disks, ellipses and rectangles.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

constexpr double kDegree = M_PI / 180;

/// Value of a white floor (y = 0) at (x, 0, 0), seen from straight above. A floor of irradiance E shows E/π.
Estimate lit_floor(double x, const std::string& lights, std::uint32_t level = 8) {
  const auto scene =
      TestScene::from_text(document(fmt::format(R"("eye": [{0}, 0.05, 0.001], "look_at": [{0}, 0, 0])", x), 0.01, 8,
                                    diffuse("floor", 1), mesh("floor", "floor.obj"), lights),
                           {{"floor.obj", plane(40, 0, true)}});
  return mean_of(scene.render({"path", 3, 1}, level), 0);
}

/// Radiance at the origin from a direction, with more objects and materials.
double seen_towards(const std::string& direction, const std::string& lights, const std::string& objects,
                    const std::string& materials, const std::string& method = "path") {
  const auto scene = TestScene::from_text(
      document(fmt::format(R"("eye": [0, 0, 0], "look_at": {}, "up": [0, 0, 1])", direction), 0.01, 8,
               diffuse("black", 0) + materials, sphere("black", "[0, -90, 0]", 1) + objects, lights));
  const Estimate mean = mean_of(scene.render({method, 3, 0}, 2), 0);
  EXPECT_LE(mean.standard_error, 1e-4 * mean.value + 1e-12);
  return mean.value;
}

const std::string kMirror = also(named("mirror", R"("mirror": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}})"));
/// A mirror that sends a camera ray along −y to +y.
const std::string kMirrorBelow = also(plane_shape("mirror", "[0, -2, 0]", "[0, 1, 0]"));

std::string sun_disk(double elevation_degrees, double angle_degrees, double irradiance) {
  return fmt::format(R"({{"directional": {{"direction": [{}, {}, 0], "irradiance": {}, "angle_degrees": {}}}}})",
                     -std::cos(elevation_degrees * kDegree), -std::sin(elevation_degrees * kDegree), gray(irradiance),
                     angle_degrees);
}

/// Irradiance on a floor from a disk in the sky: its radiance times the integral of the cosine over its part above the
/// horizon, as a sum over directions.
double irradiance_of_sun(double elevation_degrees, double angle_degrees, double irradiance) {
  const double half = angle_degrees / 2 * kDegree, radiance = irradiance / (M_PI * std::pow(std::sin(half), 2));
  constexpr int kSteps = 2000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double off = half * (i + 0.5) / kSteps;
    for (int j = 0; j < kSteps; ++j) {
      const double turn = 2 * M_PI * (j + 0.5) / kSteps, e = elevation_degrees * kDegree;
      const double height = std::cos(off) * std::sin(e) + std::sin(off) * std::cos(turn) * std::cos(e);
      sum += std::max(height, 0.0) * std::sin(off);
    }
  }
  return radiance * sum * half / kSteps * 2 * M_PI / kSteps;
}

TEST(Sun, ADiskKeepsTheIrradianceOfParallelLight) {
  for (const double angle : {0.53, 5.0, 60.0}) {
    expect_answer(lit_floor(0.3, sun_disk(90, angle, 7)), 7 / M_PI, 2e-3);
    expect_answer(lit_floor(0.3, sun_disk(35, angle, 7)), 7 * std::sin(35 * kDegree) / M_PI, 5e-3);
  }
}

TEST(Sun, SetsGradually) {
  for (const double elevation : {20.0, 5.0, 0.0, -10.0}) {
    const double exact = irradiance_of_sun(elevation, 60, 7);
    expect_answer(lit_floor(0, sun_disk(elevation, 60, 7), 12), exact / M_PI, 2e-2);
  }
  EXPECT_EQ(lit_floor(0, sun_disk(-31, 60, 7)).value, 0);
}

TEST(Sun, HasTheRadianceOfItsIrradianceAndAngle) {
  const double radiance = 7 / (M_PI * std::pow(std::sin(5 * kDegree), 2));
  for (const char* method : {"path", "caustic", "ppm", "vcm"}) {
    EXPECT_NEAR(seen_towards("[0, 1, 0]", sun_disk(90, 10, 7), "", "", method), radiance, 1e-4 * radiance) << method;
    EXPECT_EQ(seen_towards("[0.09, 1, 0]", sun_disk(90, 10, 7), "", "", method), 0) << method;  // 5.14° off
    EXPECT_NEAR(seen_towards("[0.0001, -1, 0]", sun_disk(90, 10, 7), kMirrorBelow, kMirror, method), radiance / 2,
                1e-4 * radiance)
        << method;
  }
  // An object before it hides it.
  EXPECT_EQ(seen_towards("[0, 1, 0]", sun_disk(90, 10, 7), also(sphere("black", "[0, 1e4, 0]", 1e3)), ""), 0);
}

TEST(SphereLight, IrradianceIsThatOfAPoint) {
  // E = πL (r/d)² cosθ, with L = I/(πr²): that of a point while all of it is above the horizon.
  for (const double radius : {1e-4, 0.5, 1.9}) {
    for (const double x : {0.0, 2.5}) {
      const std::string light =
          fmt::format(R"({{"point": {{"position": [0, 2, 0], "intensity": {}, "radius": {}}}}})", gray(6), radius);
      expect_answer(lit_floor(x, light, 10), 6 * 2 / std::pow(4 + x * x, 1.5) / M_PI, 1e-2);
    }
  }
}

TEST(SphereLight, HasTheRadianceOfItsIntensity) {
  const std::string light = R"({"point": {"position": [0, 9, 0], "intensity": {"rgb": [6, 6, 6]}, "radius": 0.5}})";
  const double radiance = 6 / (M_PI * 0.25);
  for (const char* method : {"path", "caustic", "ppm", "vcm"}) {
    EXPECT_NEAR(seen_towards("[0, 1, 0]", light, "", "", method), radiance, 1e-4 * radiance) << method;
    EXPECT_NEAR(seen_towards("[0.054, 1, 0]", light, "", "", method), radiance, 1e-4 * radiance) << method;
    EXPECT_EQ(seen_towards("[0.057, 1, 0]", light, "", "", method), 0) << method;  // the edge is at 1/√323
    EXPECT_NEAR(seen_towards("[0.0001, -1, 0]", light, kMirrorBelow, kMirror, method), radiance / 2, 1e-4 * radiance)
        << method;
  }
  EXPECT_EQ(seen_towards("[0, 1, 0]", light, also(sphere("black", "[0, 5, 0]", 1)), ""), 0);
  EXPECT_NEAR(seen_towards("[0, 1, 0]", light, also(sphere("black", "[0, 20, 0]", 1)), ""), radiance, 1e-4 * radiance);
}

TEST(SphereLight, IsSeenThroughFog) {
  // A shape with index 1 absorbs e^(−σ d) on the way to the sphere's surface.
  const std::string fog =
      also(R"({"name": "fog", "dielectric": {"ior": 1}, "interior": {"absorption": {"rgb": [0.2, 0.2, 0.2]}}})");
  const std::string light = R"({"point": {"position": [0, 9, 0], "intensity": {"rgb": [6, 6, 6]}, "radius": 0.5}})";
  const double radiance = 6 / (M_PI * 0.25);
  for (const double radius : {4.0, 20.0}) {
    const double way = std::min(radius, 8.5);
    EXPECT_NEAR(seen_towards("[0, 1, 0]", light, also(sphere("fog", "[0, 0, 0]", radius)), fog),
                radiance * std::exp(-0.2 * way), 1e-3 * radiance);
  }
}

/// A floor of rough metal under a light. Its mean radiance is the same under an emissive sphere in place of the light.
TEST(SphereLight, RoughMetalShowsItAsItShowsAnEmissiveSphere) {
  const auto shown = [](const std::string& lights, const std::string& objects) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [3, 3, 0], "look_at": [0, 0, 0])", 40, 16,
                 named("metal", R"("conductor": {"metal": "gold", "roughness": 0.3})") + also(diffuse("lamp", 0, 8)),
                 mesh("metal", "floor.obj") + objects, lights),
        {{"floor.obj", plane(40, 0, true)}});
    return mean_of(scene.render({"path", 3, 0}, 10), 0);
  };
  const Estimate object = shown("", also(sphere("lamp", "[-2, 2, 0]", 0.7)));
  const Estimate light = shown(
      fmt::format(R"({{"point": {{"position": [-2, 2, 0], "intensity": {}, "radius": 0.7}}}})", gray(8 * M_PI * 0.49)),
      "");
  EXPECT_LT(light.standard_error, 5e-3 * light.value);
  EXPECT_NEAR(light.value, object.value, 5 * std::hypot(light.standard_error, object.standard_error));
}

std::string disk_light(const std::string& fields, double radiance) {
  return fmt::format(R"({{"disk": {{"position": [0, 2, 0], "direction": [0, -1, 0], "radiance": {}, {}}}}})",
                     gray(radiance), fields);
}

TEST(DiskLight, HasItsFormFactorOnTheAxis) {
  // E = πL r²/(r² + h²).
  for (const double radius : {1e-3, 0.5, 3.0}) {
    const double exact = 4 * radius * radius / (radius * radius + 4);
    expect_answer(lit_floor(0, disk_light(fmt::format(R"("radius": {})", radius), 4), 12), exact, 5e-3);
  }
}

TEST(DiskLight, ShinesOnOneSide) {
  const std::string light = disk_light(R"("radius": 0.5)", 4);
  for (const char* method : {"path", "caustic", "ppm", "vcm"}) {
    EXPECT_NEAR(seen_towards("[0, 1, 0]", light, "", "", method), 4, 1e-4) << method;
    EXPECT_NEAR(seen_towards("[0.24, 1, 0]", light, "", "", method), 4, 1e-4) << method;
    EXPECT_EQ(seen_towards("[0.26, 1, 0]", light, "", "", method), 0) << method;
  }
  const std::string away =
      R"({"disk": {"position": [0, 2, 0], "direction": [0, 1, 0], "radiance": {"rgb": [4, 4, 4]}}})";
  EXPECT_EQ(seen_towards("[0, 1, 0]", away, "", ""), 0);
  EXPECT_EQ(lit_floor(0, away).value, 0);
}

TEST(DiskLight, UnitsConvert) {
  // Φ = πL · πr², exitance πL.
  const auto radiance = [](const std::string& strength) {
    return seen_towards("[0, 1, 0]",
                        fmt::format(R"({{"disk": {{"position": [0, 2, 0], "direction": [0, -1, 0], "radius": 0.5}},
                                        "strength": {{{}}}}})",
                                    strength),
                        "", "");
  };
  EXPECT_NEAR(radiance(fmt::format(R"("watt": {})", 4 * M_PI * M_PI * 0.25)), 4, 1e-4);
  EXPECT_NEAR(radiance(fmt::format(R"("lumen": {})", 683 * 4 * M_PI * M_PI * 0.25)), 4, 1e-4);
  EXPECT_NEAR(radiance(fmt::format(R"("lux": {})", 683 * 4 * M_PI)), 4, 1e-4);
  EXPECT_NEAR(radiance(R"("watt_per_square_metre_steradian": 4)"), 4, 1e-4);
}

TEST(SpotLight, ABallIsFullWithinTheConeAndDarkOutside) {
  // Straight down from height 2. On the axis all of the ball shines with the full intensity: 24° suffice for the
  // smaller one.
  const auto spot = [](double radius) {
    return fmt::format(
        R"({{"spot": {{"position": [0, 2, 0], "direction": [0, -1, 0], "intensity": {}, "cutoff_degrees": 30,
            "blend": 0.2, "radius": {}}}}})",
        gray(6), radius);
  };
  expect_answer(lit_floor(0, spot(0.2), 8), 6 / 4.0 / M_PI, 2e-3);
  EXPECT_EQ(lit_floor(2 * std::tan(30 * kDegree) + 0.25, spot(0.2)).value, 0);
  // Between, light from some of the ball arrives where a point would be dark.
  EXPECT_GT(lit_floor(2 * std::tan(30 * kDegree) + 0.05, spot(0.2)).value, 0);
  // Seen from below, its radiance is I/(πr²).
  const double radiance = 6 / (M_PI * 0.04);
  for (const char* method : {"path", "caustic", "ppm", "vcm"}) {
    EXPECT_NEAR(seen_towards("[0, 1, 0]", spot(0.2), "", "", method), radiance, 1e-4 * radiance) << method;
  }
}

TEST(SpotLight, ABallKeepsTheFlux) {
  // All of 1 W reaches a patch that holds the whole cone.
  const auto scene = scene_with(
      R"("materials": [{"name": "m", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}}],
         "objects": [{"material": "m", "sphere": {"center": [0, -3, 0], "radius": 1}}],
         "lights": [{"spot": {"position": [0, 2, 0], "direction": [0, -1, 0], "cutoff_degrees": 40, "blend": 0.5,
                     "radius": 0.3}, "strength": {"watt": 1}}],
         "meters": [{"name": "m", "flux": {"patch": {"corner": [-3, 0, -3], "edge1": [0, 0, 6], "edge2": [6, 0, 0]}}}])");
  expect_reading(read_meters(scene, 6).front(), 1, 1.1e-2);
}

TEST(EllipseLight, IrradianceIsTheIntegralOverTheEllipse) {
  // E = L ∫ cos²θ/d² dA = L ∫ h²/d⁴ dA, off its centre, with the long radius along z.
  const std::string light = disk_light(R"("radius": 1.5, "second_radius": 0.4, "up": [0, 1, 1])", 4);
  for (const double x : {0.0, 1.0}) {
    constexpr int kSteps = 1000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double rho = (i + 0.5) / kSteps;
      for (int j = 0; j < kSteps; ++j) {
        const double turn = 2 * M_PI * (j + 0.5) / kSteps;
        const double d2 = 4 + std::pow(0.4 * rho * std::cos(turn) - x, 2) + std::pow(1.5 * rho * std::sin(turn), 2);
        sum += 4 / (d2 * d2) * rho;
      }
    }
    const double exact = 4 * sum * 1.5 * 0.4 / kSteps * 2 * M_PI / kSteps;
    expect_answer(lit_floor(x, light, 10), exact / M_PI, 5e-3);
  }
  // It is wider along z than along x.
  EXPECT_NEAR(seen_towards("[0, 1, 0.7]", light, "", ""), 4, 1e-4);
  EXPECT_EQ(seen_towards("[0.7, 1, 0]", light, "", ""), 0);
}

TEST(DiskLight, ASpreadIsTheShareThatSlatsLetPass) {
  // E = 2πL ∫ (1 − ρ cot h/z) z²ρ/(ρ² + z²)² dρ on the axis at distance z, up to the edge of the light or of its cone.
  for (const double spread : {20.0, 60.0, 120.0}) {
    const double cot = 1 / std::tan(spread / 2 * kDegree), z = 2, edge = std::min(1.5, z / cot);
    constexpr int kSteps = 100'000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double rho = edge * (i + 0.5) / kSteps;
      sum += (1 - rho * cot / z) * z * z * rho / std::pow(rho * rho + z * z, 2);
    }
    const double exact = 2 * M_PI * 4 * sum * edge / kSteps;
    expect_answer(lit_floor(0, disk_light(fmt::format(R"("radius": 1.5, "spread_degrees": {})", spread), 4), 12),
                  exact / M_PI, 1e-2);
  }
  const std::string narrow = disk_light(R"("radius": 0.5, "spread_degrees": 60)", 4);
  for (const double degrees : {0.0, 10.0, 25.0}) {  // seen from (0, 0, 0), at this angle to its normal
    const double t = std::tan(degrees * kDegree);
    if (2 * t < 0.5) {
      EXPECT_NEAR(seen_towards(fmt::format("[{}, 1, 0]", t), narrow, "", ""), 4 * (1 - t / std::tan(30 * kDegree)),
                  1e-3);
    }
  }
}

TEST(DiskLight, ASpreadKeepsThePower) {
  // 1 W in a cone of 60° reaches a patch that holds all of it.
  const auto scene = scene_with(
      R"("materials": [{"name": "m", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}}],
         "objects": [{"material": "m", "sphere": {"center": [0, -3, 0], "radius": 1}}],
         "lights": [{"disk": {"position": [0, 2, 0], "direction": [0, -1, 0], "radius": 0.3, "spread_degrees": 60},
                     "strength": {"watt": 1}}],
         "meters": [{"name": "m", "flux": {"patch": {"corner": [-2, 0, -2], "edge1": [0, 0, 4], "edge2": [4, 0, 0]}}}])");
  expect_reading(read_meters(scene, 6).front(), 1, 2e-2);
}

std::string rectangle_light(const std::string& fields) {
  return fmt::format(R"({{"rectangle": {{"position": [0, 2, 0], "direction": [0, -1, 0], {}}}}})", fields);
}

/// Form factor from a point to a parallel rectangle that has a corner at height 1 above it, and the sides a and b.
double corner_factor(double a, double b) {
  const double p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
  return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * M_PI);
}

TEST(RectangleLight, HasItsFormFactor) {
  // 0.8 along z (its `up`) and 3 along x, at height 2: E = πLF, and a white floor shows LF. Off the centre, four corners
  // are above the point, two of them with a negative part.
  const std::string light =
      rectangle_light(R"("width": 3, "height": 0.8, "up": [0, 1, 1], "radiance": {"rgb": [4, 4, 4]})");
  for (const double x : {0.0, 2.5}) {
    const double factor = 2 * (corner_factor((1.5 + x) / 2, 0.2) + corner_factor((1.5 - x) / 2, 0.2));
    expect_answer(lit_floor(x, light, 12), 4 * factor, 5e-3);
  }
}

TEST(RectangleLight, PathsAndPhotonsGiveItsFormFactor) {
  // Unit squares: parallel at distance 1, and perpendicular with a common edge. Meters need no photon radius.
  for (const auto& [place, factor] : {std::pair(R"("position": [0.5, 1, 0.5], "direction": [0, -1, 0])", 0.1998249),
                                      {R"("position": [0, 0.5, 0.5], "direction": [1, 0, 0])", 0.2000438}}) {
    const auto scene = scene_with(fmt::format(
        R"("materials": [{}], "objects": [{}], "lights": [{{"rectangle": {{{}, "radiance": {}}}}}],
           "meters": [{{"name": "m", "patch": {{"corner": [0, 0, 0], "edge1": [0, 0, 1], "edge2": [1, 0, 0]}}}}])",
        diffuse("black", 0), sphere("black", "[0, -3, 0]", 1), place, gray(2)));
    for (const char* method : {"path", "ppm:photons=20000", "vcm:photons=20000"}) {
      SCOPED_TRACE(method);
      const auto reading = read_meters(scene, 6, 1, nullptr, method).front();
      expect_reading(reading, 2 * M_PI * factor, 3e-2);
    }
  }
}

TEST(RectangleLight, ShowsItsCornersToAllMethods) {
  const std::string light =
      rectangle_light(R"("width": 1, "height": 0.6, "up": [0, 0, 1], "radiance": {"rgb": [4, 4, 4]})");
  for (const char* method : {"path", "caustic", "ppm", "vcm"}) {
    EXPECT_NEAR(seen_towards("[0.24, 1, 0.14]", light, "", "", method), 4, 1e-4) << method;
    EXPECT_EQ(seen_towards("[0.26, 1, 0]", light, "", "", method), 0) << method;
    EXPECT_EQ(seen_towards("[0, 1, 0.16]", light, "", "", method), 0) << method;
  }
}

TEST(RectangleLight, ASpreadKeepsThePower) {
  // 1 W in a cone of 60° reaches a patch that holds all of it.
  const auto scene = scene_with(
      R"("materials": [{"name": "m", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}}],
         "objects": [{"material": "m", "sphere": {"center": [0, -3, 0], "radius": 1}}],
         "lights": [{"rectangle": {"position": [0, 2, 0], "direction": [0, -1, 0], "width": 0.5, "spread_degrees": 60},
                     "strength": {"watt": 1}}],
         "meters": [{"name": "m", "flux": {"patch": {"corner": [-2, 0, -2], "edge1": [0, 0, 4], "edge2": [4, 0, 0]}}}])");
  expect_reading(read_meters(scene, 6).front(), 1, 2e-2);
}

TEST(SizedLights, HiddenFromTheCameraTheyShowInMirrorsAlone) {
  for (const std::string& shown :
       {sun_disk(90, 10, 7), disk_light(R"("radius": 0.5)", 4), rectangle_light(R"("radiance": {"rgb": [4, 4, 4]})"),
        std::string(R"({"point": {"position": [0, 9, 0], "intensity": {"rgb": [6, 6, 6]}, "radius": 0.5}})")}) {
    std::string hidden = shown;
    hidden.insert(1, R"("hidden_from_camera": true, )");
    EXPECT_GT(seen_towards("[0, 1, 0]", shown, "", ""), 1);
    EXPECT_EQ(seen_towards("[0, 1, 0]", hidden, "", ""), 0);
    EXPECT_EQ(seen_towards("[0.0001, -1, 0]", hidden, kMirrorBelow, kMirror),
              seen_towards("[0.0001, -1, 0]", shown, kMirrorBelow, kMirror));
  }
}

/// A patch of a white floor below a glass ball, under one light. Photons, connections and paths that meet the light
/// must agree on what arrives: direct light, and the caustic.
TEST(SizedLights, AllMethodsAgreeOnTheirCaustics) {
  for (const std::string& light :
       {sun_disk(70, 25, 7), disk_light(R"("radius": 0.8, "second_radius": 0.5, "spread_degrees": 150)", 4),
        std::string(R"({"point": {"position": [0.5, 3, 0], "intensity": {"rgb": [6, 6, 6]}, "radius": 0.6}})"),
        std::string(R"({"spot": {"position": [0.5, 3, 0], "direction": [-0.1, -1, 0], "intensity": {"rgb": [9, 9, 9]},
                        "cutoff_degrees": 35, "blend": 0.5, "radius": 0.6}})")}) {
    const auto scene = scene_with(fmt::format(R"("materials": [{}, {}], "objects": [{}, {}], "lights": [{}],
             "meters": [{{"name": "m", "patch": {{"corner": [-0.5, 0.001, -0.5], "edge1": [0, 0, 1], "edge2": [1, 0, 0]}}}}])",
                                              diffuse("floor", 0.5), named("glass", R"("dielectric": {"ior": 1.5})"),
                                              mesh("floor", "floor.obj"), sphere("glass", "[0, 0.9, 0]", 0.5), light),
                                  {{"floor.obj", horizontal_square(6, 0, true)}});
    const MeterReading path = read_meters(scene, 7, 1).front();
    for (const char* method : {"caustic:photons=20000", "ppm:photons=20000", "vcm:photons=20000"}) {
      const MeterReading other = read_meters(scene, 3, 2, nullptr, method).front();
      EXPECT_NEAR(other.value, path.value, 5 / 1.96 * std::hypot(other.half_width, path.half_width)) << method << light;
      // Few photons of a sun reach the patch, because they cover all of the scene.
      const double precision = method == std::string("ppm:photons=20000") ? 0.3 : 0.05;
      EXPECT_LT(other.half_width, precision * path.value) << method << light;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
