// Light at smooth surfaces of glass: Fresnel's equations with several indices, a slab's whole series, and three scenes
// with light through glass or a mirror. All are public scene documents.
#include <functional>

#include "tests/analytic/glass_answers.h"
#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// Reflectance at an angle in degrees.
double fresnel_at(double degrees, double n) {
  return fresnel(degrees * M_PI / 180, n);
}

/// ∫ f cosθ dω / π over the hemisphere. The argument of f is in degrees.
double diffuse_mean(const std::function<double(double)>& f) {
  constexpr int kSteps = 200'000;
  double sum = 0;
  for (int k = 0; k < kSteps; ++k) {
    sum += f(std::asin(std::sqrt((k + 0.5) / kSteps)) * 180 / M_PI);
  }
  return sum / kSteps;
}

constexpr const char* kSky = R"({"environment": {"radiance": {"rgb": [1, 1, 1]}}})";

/// Radiance seen at the origin, on the surface of a half-space of glass over black, under a uniform sky of radiance 1.
/// The camera looks at this angle to the vertical, from above or from within.
Estimate seen_at_surface(double degrees, double ior, bool within, const std::string& method, std::uint32_t level) {
  const double theta = degrees * M_PI / 180;
  const double side = within ? -1 : 1;
  const auto scene = TestScene::from_text(document(
      fmt::format(R"("eye": [{}, {}, 0], "look_at": [0, 0, 0], "up": [0, 0, 1])", std::sin(theta),
                  side * std::cos(theta)),
      0.0001, 8, glass(ior) + "," + diffuse("black", 0),
      plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]") + "," + plane_shape("black", "[0, -3, 0]", "[0, 1, 0]"), kSky));
  return mean_of(scene.render({method, 1, 0}, level), 0);
}

TEST(Interface, ReflectsByFresnelWhateverItsIndex) {
  EXPECT_NEAR(fresnel_at(60, 1.5), 0.0891867, 5e-8);  // checks the formula
  for (const double n : {1.5, 1.33, 2.4, 1 / 1.5}) {
    for (const double degrees : {0.0, 30.0, 45.0, 60.0, 75.0, 85.0}) {
      const double exact = fresnel_at(degrees, n);
      EXPECT_NEAR(seen_at_surface(degrees, n, false, "whitted", 1).value, exact, 2e-5 * exact + 1e-6)
          << n << ' ' << degrees;
    }
  }
  for (const auto& [degrees, n] : {std::pair(45.0, 1.33), {70.0, 2.4}}) {
    expect_answer(seen_at_surface(degrees, n, false, "path", 12), fresnel_at(degrees, n), 2e-2);
  }
}

TEST(Interface, ReflectsAllBeyondTheCriticalAngle) {
  // From within, the camera sees the sky, n² times as dense, times the transmittance. Beyond the critical angle it sees
  // none of it.
  for (const auto& [n, critical] : {std::pair(1.5, 41.810315), {2.4, std::asin(1 / 2.4) * 180 / M_PI}}) {
    EXPECT_NEAR(std::sin(critical * M_PI / 180) * n, 1, 1e-7);
    const double below = critical - 0.002, outside = std::asin(std::sin(below * M_PI / 180) * n) * 180 / M_PI;
    const double exact = n * n * (1 - fresnel_at(outside, n));
    EXPECT_GT(exact, 0.05);
    const Estimate through = seen_at_surface(below, n, true, "path", 11);
    // Near that angle the transmittance is a square root of a small difference. Single precision knows it to 1e-3.
    EXPECT_NEAR(through.value, exact, 5 * through.standard_error + 3e-3 * exact) << n;
    EXPECT_LT(through.standard_error, 0.02 * exact);
    EXPECT_NEAR(seen_at_surface(below, n, true, "whitted", 1).value, exact, 3e-3 * exact) << n;
    for (const std::string method : {"path", "whitted"}) {
      EXPECT_EQ(seen_at_surface(critical + 0.002, n, true, method, 6).value, 0) << n << method;
    }
  }
}

TEST(Interface, ReflectsHalfOfTheSPolarisationAtBrewstersAngle) {
  for (const double n : {1.5, 2.0, 1.2}) {
    const double degrees = std::atan(n) * 180 / M_PI, s = (n * n - 1) / (n * n + 1);
    EXPECT_NEAR(seen_at_surface(degrees, n, false, "whitted", 1).value, s * s / 2, 2e-6) << n;
  }
  EXPECT_NEAR(seen_at_surface(56.309932, 1.5, false, "whitted", 1).value, 0.5 * 25 / 169, 2e-6);
  expect_answer(seen_at_surface(56.309932, 1.5, false, "path", 12), 0.5 * 25 / 169, 2e-2);
}

TEST(Interface, DiffuseMeansMatchTheIntegralOnBothSides) {
  // Outside, a meter that looks down at glass under a uniform sky reads π times the mean reflectance. In the glass,
  // over a glowing floor, a meter that looks up does too.
  EXPECT_NEAR(diffuse_mean([](double degrees) { return fresnel_at(degrees, 1.5); }), 0.0917780, 1e-6);
  for (const auto& [n, outer, inner] : {std::tuple(1.5, 0.0917780, 0.5963458),
                                        {2.0, diffuse_mean([](double degrees) { return fresnel_at(degrees, 2); }),
                                         diffuse_mean([](double degrees) { return fresnel_at(degrees, 0.5); })}}) {
    const auto above = scene_with(fmt::format(
        R"("materials": [{}, {}], "objects": [{}, {}], "lights": [{}],
           "meters": [{{"name": "m", "irradiance": {{"point": [0, 1, 0], "normal": [0, -1, 0]}}}}])",
        glass(n), diffuse("black", 0), plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]"),
        plane_shape("black", "[0, -1, 0]", "[0, 1, 0]"), kSky));
    expect_reading(read_meters(above, 6).front(), M_PI * outer, 2e-2);
    const auto below =
        scene_with(fmt::format(R"("materials": [{}, {}], "objects": [{}, {}],
           "meters": [{{"name": "m", "irradiance": {{"point": [0, -1, 0], "normal": [0, 1, 0]}}}}])",
                               glass(n), diffuse("floor", 0, 1), plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]"),
                               plane_shape("floor", "[0, -2, 0]", "[0, 1, 0]")));
    expect_reading(read_meters(below, 6).front(), M_PI * inner, 1e-2);
  }
}

TEST(Slab, TransmitsByTheClosedFormAtAnyIndexAndAngle) {
  // T = (1 − R)² t / (1 − R² t²), t = e^(−σ d / cos of the angle within), seen against a glowing wall.
  for (const auto& [n, degrees, sigma] : {std::tuple(1.33, 30.0, 0.0),
                                          {2.0, 70.0, 0.0},
                                          {1.5, 50.0, 0.4},
                                          {1.8, 25.0, 1.3},
                                          {1.5, 0.0, 0.0},
                                          {1.5, 60.0, 0.0}}) {
    const double theta = degrees * M_PI / 180, r = fresnel_at(degrees, n);
    const double t = std::exp(-sigma / std::cos(std::asin(std::sin(theta) / n)));
    const double exact = (1 - r) * (1 - r) * t / (1 - r * r * t * t);
    const auto scene = TestScene::from_text(document(
        fmt::format(R"("eye": [{}, {}, 0], "look_at": [0, 0, 0], "up": [0, 0, 1])", 3 * std::sin(theta),
                    3 * std::cos(theta)),
        0.0001, 8,
        fmt::format(R"({{"name": "glass", "dielectric": {{"ior": {}}}, "interior": {{"absorption": {}}}}})", n,
                    gray(sigma)) +
            "," + diffuse("lamp", 0, 1),
        plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]") + "," + plane_shape("glass", "[0, -1, 0]", "[0, -1, 0]") + "," +
            plane_shape("lamp", "[0, -5, 0]", "[0, 1, 0]")));
    EXPECT_NEAR(mean_of(scene.render({"whitted", 1, 0}, 1), 0).value, exact, 2e-5) << n << ' ' << degrees;
    expect_answer(mean_of(scene.render({"path", 1, 0}, 11), 0), exact, 2e-2);
  }
}

// Scene A: the sun at normal incidence through a slab onto a diffuse floor. Camera paths cannot hit a sun without
// extent. So this one is a distant square of ±15°. Its light arrives like that of the zenith to 2e-4.
TEST(SceneA, TheSunLightsADiffuseFloorThroughASlab) {
  constexpr double kHeight = 2000, kHalf = 536;
  struct Case {
    double n, reflectance, table;
  };
  for (const Case& c : {Case{1.5, 0.2, 0.1905390}, {1.5, 0.5, 0.5004331}, {1.5, 0.8, 0.8433346}, {2.0, 0.6, 0}}) {
    const auto slab = [&](double degrees) {
      const double r = fresnel_at(degrees, c.n);
      return (1 - r) / (1 + r);
    };
    const auto floor = [&](double transmitted) {
      return c.reflectance * transmitted / (1 - c.reflectance * (1 - diffuse_mean(slab)));
    };
    if (c.table > 0) {
      EXPECT_NEAR(floor(slab(0)), c.table, 1e-6);
    }
    double all = 0, transmitted = 0;
    constexpr int kSteps = 300;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double x = kHalf * (2 * (i + 0.5) / kSteps - 1), z = kHalf * (2 * (j + 0.5) / kSteps - 1);
        const double cosine = kHeight / std::sqrt(kHeight * kHeight + x * x + z * z), weight = std::pow(cosine, 4);
        all += weight;
        transmitted += weight * slab(std::acos(cosine) * 180 / M_PI);
      }
    }
    EXPECT_NEAR(transmitted / all, slab(0), 2e-4);
    const double irradiance_of_one = all * std::pow(2 * kHalf / kSteps / kHeight, 2);  // of radiance 1, without glass
    const auto scene = scene_with(
        fmt::format(R"("materials": [{}, {}, {}], "objects": [{}, {}, {}, {}],
           "meters": [{{"name": "m", "irradiance": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}])",
                    glass(c.n), diffuse("floor", c.reflectance), diffuse("sun", 0, M_PI / irradiance_of_one),
                    plane_shape("glass", "[0, 2, 0]", "[0, 1, 0]"), plane_shape("glass", "[0, 1, 0]", "[0, -1, 0]"),
                    plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]"), mesh("sun", "sun.obj")),
        {{"sun.obj", horizontal_square(2 * kHalf, kHeight, false)}});
    // The floor emits ρE/π. The slab shifts light sideways by one unit of 2000: 1e-4.
    expect_reading(read_meters(scene, 7).front(), M_PI / c.reflectance * floor(transmitted / all), 2e-2);
  }
}

// Scene B: a light over a mirror floor, and a wall. A sphere light gives the same as a point of the same intensity
// wherever all of it is visible. So the table's numbers also hold for an emitter that paths can meet in the mirror.
TEST(SceneB, AnEmitterOverAMirrorFloorLightsAWallTwice) {
  struct Case {
    double intensity, height, reflectance, y, direct, mirrored;
  };
  const auto exact = [](double intensity, double height, double y) {
    return intensity / std::pow(1 + (height - y) * (height - y), 1.5);
  };
  for (const Case& c : {Case{M_PI, 1, 1, 0.25, 1.6084954, 0.7658682},
                        {M_PI, 1, 1, 0.5, 2.2479407, 0.5361976},
                        {M_PI, 1, 1, 1, 3.1415927, 0.2809926},
                        {2, 1.2, 0.7, 0.6, exact(2, 1.2, 0.6), 0.7 * exact(2, -1.2, 0.6)}}) {
    const double radius = 0.3;
    for (const bool with_mirror : {false, true}) {
      const auto scene = scene_with(fmt::format(
          R"("materials": [{}, {{"name": "mirror", "mirror": {{"reflectance": {}}}}}], "objects": [{}{}],
             "meters": [{{"name": "m", "irradiance": {{"point": [1, {}, 0], "normal": [-1, 0, 0]}}}}])",
          diffuse("lamp", 0, c.intensity / (M_PI * radius * radius)), gray(c.reflectance),
          sphere("lamp", fmt::format("[0, {}, 0]", c.height), radius),
          with_mirror ? fmt::format(", {}", plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]")) : "", c.y));
      const MeterReading reading = read_meters(scene, with_mirror ? 7 : 5).front();
      expect_reading(reading, c.direct + (with_mirror ? c.mirrored : 0), 1e-2);
    }
  }
}

TEST(SceneB, EveryMethodSeesDirectLightOfAPointOnTheWall) {
  // Light through the mirror would add to this, but no camera path reaches a point light.
  struct Case {
    double intensity, height, y, direct;
  };
  for (const Case& c : {Case{M_PI, 1, 0.25, 1.6084954},
                        {M_PI, 1, 0.5, 2.2479407},
                        {M_PI, 1, 1, 3.1415927},
                        {2, 1.2, 0.6, 2 / std::pow(1.36, 1.5)}}) {
    const auto scene = TestScene::from_text(document(
        fmt::format(R"("eye": [0.5, {0}, 0.4], "look_at": [1, {0}, 0])", c.y), 0.001, 8,
        diffuse("wall", 1) + R"(, {"name": "mirror", "mirror": {}})",
        plane_shape("wall", "[1, 0, 0]", "[-1, 0, 0]") + also(plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]")),
        fmt::format(R"({{"point": {{"position": [0, {}, 0], "intensity": {}}}}})", c.height, gray(c.intensity))));
    for (const std::string method : {"path", "raycast", "whitted"}) {
      EXPECT_NEAR(mean_of(scene.render({method, 1, 1}, 4), 0).value, c.direct / M_PI, 2e-5 * c.direct) << method;
    }
  }
}

/// The same for a sphere of this radius with the same total intensity. It sums over the outside directions that reach
/// the floor's point, because n² cosθ dω within is cosθ dω outside.
double sphere_through_surface(double x, double n, double h, double d, double radius) {
  constexpr int kRings = 8000, kParts = 500;
  double sum = 0;
  for (int i = 0; i < kRings; ++i) {
    const double sine = std::sqrt((i + 0.5) / kRings), cosine = std::sqrt(1 - sine * sine);
    const double within = std::asin(sine / n);
    int met = 0;
    for (int j = 0; j < kParts; ++j) {
      const double phi = M_PI * (j + 0.5) / kParts;  // symmetric in z
      const Vec3d direction(-sine * std::cos(phi), cosine, sine * std::sin(phi));
      const Vec3d from(x - d * std::tan(within) * std::cos(phi), 0, d * std::tan(within) * std::sin(phi));
      met += glm::length(glm::cross(Vec3d(0, h, 0) - from, direction)) < radius ? 1 : 0;
    }
    sum += met * (1 - fresnel_at(std::asin(sine) * 180 / M_PI, n));
  }
  return sum * M_PI / kRings / kParts / (radius * radius);
}

// Scene C: a light over a half-space of glass with a black bottom. Again the light is a sphere.
TEST(SceneC, AnEmitterOverAHalfSpaceOfGlassLightsItsBottom) {
  struct Case {
    double n, height, depth, x, table;
  };
  for (const Case& c : {Case{1.5, 1, 1, 0, 1.0857344},
                        {1.5, 1, 1, 0.5, 0.9894944},
                        {1.5, 1, 1, 1, 0.7657047},
                        {1.33, 0.8, 2, 0.6, 0}}) {
    const double point = point_through_surface(c.x, c.n, c.height, c.depth);
    if (c.table > 0) {
      EXPECT_NEAR(point, c.table, 1e-6);
    }
    const double radius = 0.4, exact = sphere_through_surface(c.x, c.n, c.height, c.depth, radius);
    EXPECT_NEAR(exact, point, 0.1 * point);  // the difference falls as radius²
    EXPECT_NEAR(sphere_through_surface(c.x, c.n, c.height, c.depth, radius / 2), point, 0.025 * point);
    const auto scene = scene_with(fmt::format(
        R"("materials": [{}, {}, {}], "objects": [{}, {}, {}],
           "meters": [{{"name": "m", "irradiance": {{"point": [{}, {}, 0], "normal": [0, 1, 0]}}}}])",
        glass(c.n), diffuse("black", 0), diffuse("lamp", 0, 1 / (radius * radius)),
        plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]"),
        plane_shape("black", fmt::format("[0, {}, 0]", -c.depth), "[0, 1, 0]"),
        sphere("lamp", fmt::format("[0, {}, 0]", c.height), radius), c.x, -c.depth));
    expect_reading(read_meters(scene, 8).front(), exact, 3e-2);
  }
}

}  // namespace
}  // namespace lightmill::test
