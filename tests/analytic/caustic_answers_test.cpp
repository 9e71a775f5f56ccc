// Exact answers for light that no path from the camera can find. Methods with photons find it, including `ppm`. The
// scenes are public documents.
#include <functional>

#include "tests/analytic/glass_answers.h"
#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string point_light(double height, double intensity) {
  return fmt::format(R"({{"point": {{"position": [0, {}, 0], "intensity": {}}}}})", height, gray(intensity));
}
std::string point_meter(double x, double y, const std::string& normal) {
  return fmt::format(R"({{"name": "point", "irradiance": {{"point": [{}, {}, 0], "normal": {}}}}})", x, y, normal);
}
std::string patch_meter(double x, double y, double z, const std::string& edge1, const std::string& edge2) {
  return fmt::format(R"({{"name": "patch", "patch": {{"corner": [{}, {}, {}], "edge1": {}, "edge2": {}}}}})", x, y, z,
                     edge1, edge2);
}

constexpr double kSide = 0.5;  ///< of the patches

/// Mean over a square patch around a point of a function of two coordinates in its plane.
double mean_over_patch(const std::function<double(double, double)>& f) {
  constexpr int kSteps = 50;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      sum += f(kSide * ((i + 0.5) / kSteps - 0.5), kSide * ((j + 0.5) / kSteps - 0.5));
    }
  }
  return sum / (kSteps * kSteps);
}

std::vector<MeterReading> read(const std::string& parts, std::uint32_t level, const std::string& method) {
  return read_meters(scene_with(parts), level, 1, nullptr, method);
}

// Point meters read from a small disc, so the tolerance is 15 %. Patch meters count all photons that cross them, so it
// is 4 %.

// Scene B: a point light over a mirror floor, and a wall.
class CausticB : public ::testing::TestWithParam<std::string> {};
class CausticA : public CausticB {};
class CausticC : public CausticB {};
const auto kMethods = ::testing::Values("caustic", "ppm", "vcm");
const auto kMethodName = [](const auto& info) { return info.param; };
INSTANTIATE_TEST_SUITE_P(By, CausticA, kMethods, kMethodName);
INSTANTIATE_TEST_SUITE_P(By, CausticB, kMethods, kMethodName);
INSTANTIATE_TEST_SUITE_P(By, CausticC, kMethods, kMethodName);

TEST_P(CausticB, APointOverAMirrorLightsAWallTwice) {
  struct Case {
    double intensity, height, reflectance, y, direct, mirrored;
  };
  const auto exact = [](double intensity, double height, double y, double z = 0) {
    return intensity / std::pow(1 + (height - y) * (height - y) + z * z, 1.5);
  };
  for (const Case& c : {Case{M_PI, 1, 1, 0.25, 1.6084954, 0.7658682},
                        {M_PI, 1, 1, 0.5, 2.2479407, 0.5361976},
                        {M_PI, 1, 1, 1, 3.1415927, 0.2809926},
                        {2, 1.2, 0.7, 0.6, exact(2, 1.2, 0.6), 0.7 * exact(2, -1.2, 0.6)}}) {
    const std::string parts = fmt::format(
        R"("materials": [{{"name": "mirror", "mirror": {{"reflectance": {}}}}}], "objects": [{}], "lights": [{}],
           "meters": [{}, {}])",
        gray(c.reflectance), plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]"), point_light(c.height, c.intensity),
        point_meter(1, c.y, "[-1, 0, 0]"), patch_meter(1, c.y - kSide / 2, -kSide / 2, "[0, 0, 0.5]", "[0, 0.5, 0]"));
    const auto readings = read(parts, 5, GetParam() + ":photons=50000");
    expect_reading(readings[0], c.direct + c.mirrored, 0.15);
    const double patch = mean_over_patch([&](double y, double z) {
      return exact(c.intensity, c.height, c.y + y, z) + c.reflectance * exact(c.intensity, -c.height, c.y + y, z);
    });
    expect_reading(readings[1], patch, 4e-2);
    EXPECT_NEAR(read(parts, 1, "path")[0].value, c.direct, 1e-4 * c.direct);
  }
}

// Pictures of the same wall with reflectance 1. Directly, photons are splatted. In the mirror, they are gathered. Light
// with more bounces is cut off.
TEST_P(CausticB, TheCameraSeesTheWallDirectlyAndInTheMirror) {
  const auto irradiance = [](double y, double z) {
    return M_PI * (std::pow(1 + (1 - y) * (1 - y) + z * z, -1.5) + std::pow(1 + (1 + y) * (1 + y) + z * z, -1.5));
  };
  struct Case {
    double target;  ///< height at the wall, below 0 in the mirror
    std::uint32_t bounces;
    double precision;
  };
  for (const Case& c : {Case{0.5, 2, 0.004}, {-0.7, 3, 0.01}}) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [-1, 0.5, 0], "look_at": [1, {}, 0])", c.target), 15, 32,
                 diffuse("wall", 1) + R"(, {"name": "mirror", "mirror": {}})",
                 plane_shape("wall", "[1, 0, 0]", "[-1, 0, 0]") + also(plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]")),
                 point_light(1, M_PI)));
    const Vec3d forward = glm::normalize(Vec3d(2, c.target - 0.5, 0)), down(forward.y, -forward.x, 0);
    const double half = std::tan(7.5 * M_PI / 180);
    constexpr int kSteps = 100;
    double exact = 0;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double a = half * (2 * (i + 0.5) / kSteps - 1), b = half * (2 * (j + 0.5) / kSteps - 1);
        const Vec3d way = forward + down * a + Vec3d(0, 0, b);
        const double y = std::abs(0.5 + way.y * 2 / way.x), z = way.z * 2 / way.x;
        exact += irradiance(y, z) / M_PI / (kSteps * kSteps);
      }
    }
    const Estimate seen = mean_of(scene.render({GetParam() + ":photons=50000", 3, c.bounces}, 5), 0);
    EXPECT_LT(seen.standard_error, c.precision * exact);
    EXPECT_NEAR(seen.value, exact, 5 * seen.standard_error + 2e-3 * exact);  // limit of the blur by gathering
  }
}

// Scene A: the sun at normal incidence through a slab onto a diffuse floor. Photons cover a disc of the scene's sphere,
// and the distant camera makes the sphere large. Light from beyond it adds less than 1e-3.
TEST_P(CausticA, TheSunLightsADiffuseFloorThroughASlab) {
  for (const auto& [reflectance, radiance] : {std::pair(0.2, 0.1905390), {0.5, 0.5004331}, {0.8, 0.8433346}}) {
    const auto scene = TestScene::from_text(fmt::format(
        R"({{"camera": {{"eye": [0, 0.5, 200], "look_at": [0, 0.5, 0], "vertical_fov_degrees": 10}},
           "materials": [{}, {}], "objects": [{}, {}, {}],
           "lights": [{{"directional": {{"direction": [0, -1, 0], "irradiance": {}}}}}],
           "meters": [{{"name": "m", "patch": {{"corner": [-15, 0, -15], "edge1": [0, 0, 30], "edge2": [30, 0, 0]}}}}]}})",
        glass(1.5), diffuse("floor", reflectance), plane_shape("glass", "[0, 2, 0]", "[0, 1, 0]"),
        plane_shape("glass", "[0, 1, 0]", "[0, -1, 0]"), plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]"), gray(M_PI)));
    const auto reading = read_meters(scene, 5, 1, nullptr, GetParam() + ":photons=50000").front();
    expect_reading(reading, M_PI / reflectance * radiance, 4e-2);
  }
}

// Scene C: a point light over a half-space of glass with a black floor.
TEST_P(CausticC, APointOverAHalfSpaceLightsItsBottom) {
  struct Case {
    double n, height, depth, x, table;
  };
  for (const Case& c : {Case{1.5, 1, 1, 0, 1.0857344},
                        {1.5, 1, 1, 0.5, 0.9894944},
                        {1.5, 1, 1, 1, 0.7657047},
                        {1.33, 0.8, 2, 0.6, 0}}) {
    const double exact = point_through_surface(c.x, c.n, c.height, c.depth);
    if (c.table > 0) {
      EXPECT_NEAR(exact, c.table, 1e-6);
    }
    const std::string parts =
        fmt::format(R"("materials": [{}, {}], "objects": [{}, {}], "lights": [{}], "meters": [{}, {}])", glass(c.n),
                    diffuse("black", 0), plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]"),
                    plane_shape("black", fmt::format("[0, {}, 0]", -c.depth), "[0, 1, 0]"), point_light(c.height, M_PI),
                    point_meter(c.x, -c.depth, "[0, 1, 0]"),
                    patch_meter(c.x - kSide / 2, -c.depth, -kSide / 2, "[0, 0, 0.5]", "[0.5, 0, 0]"));
    const auto readings = read(parts, 6, GetParam() + ":photons=100000");
    expect_reading(readings[0], exact, 0.15);
    const double patch = mean_over_patch(
        [&](double x, double z) { return point_through_surface(std::hypot(c.x + x, z), c.n, c.height, c.depth); });
    expect_reading(readings[1], patch, 4e-2);
    EXPECT_EQ(read(parts, 4, "path")[0].value, 0);
  }
}

}  // namespace
}  // namespace lightmill::test
