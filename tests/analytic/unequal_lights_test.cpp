// Lights of very unequal power and distance: the one that lights a surface is sampled, whatever the others are.
#include <gtest/gtest.h>

#include <cmath>

#include "common/lights/light_choice.h"
#include "common/sampling/sobol.h"
#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

constexpr const char* kCube =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
constexpr const char* kEmitter =
    R"({"name": "l1", "material": "far", "triangle": {"a": [-3.4, 3, 1.75], "b": [-2.9, 3, 1.75], "c": [-2.9, 3, 2.25]}})";

/// A cube, a point light of 100 W one unit from its right side, and more lights or objects.
std::string cube_scene(double emitter_watt, const std::string& objects, const std::string& lights) {
  return fmt::format(
      R"("materials": [{}, {}, {{"name": "far", "diffuse": {{"reflectance": {}}}, "emission_strength": {{"watt": {}}}}}],
         "objects": [{}{}],
         "lights": [{{"name": "near", "point": {{"position": [2, 0, 0]}}, "strength": {{"watt": 100}}}}{}])",
      diffuse("grey", 0.8), diffuse("black", 0), gray(0), emitter_watt, mesh("grey", "cube.obj"), objects, lights);
}

/// Points of 10 kW behind the cube, as seen from its right side.
std::string points_behind(int count) {
  std::string out;
  for (int i = 0; i < count; ++i) {
    out += fmt::format(R"(, {{"point": {{"position": [-3, {}, 0]}}, "strength": {{"watt": 10000}}}})", 0.3 * i - 1);
  }
  return out;
}

TEST(UnequalLights, AStrongOneThatDoesNotReachTheSurfaceMakesNoNoise) {
  // E = Φ/4πd² on the right side. The other lights are behind the surface, or behind a black wall.
  const std::string emitter = also(kEmitter);
  const std::string spots =
      R"(, {"spot": {"position": [9, 0, 0], "direction": [-1, 0, 0], "cutoff_degrees": 30}, "strength": {"watt": 1e5}},
         {"spot": {"position": [9, 1, 0], "direction": [-1, 0, 0], "cutoff_degrees": 30}, "strength": {"watt": 1e5}})";
  for (const auto& [objects, lights] : {std::pair{emitter, std::string()},
                                        {emitter, points_behind(2)},
                                        {emitter, points_behind(7)},
                                        {emitter, points_behind(40)},
                                        {emitter + also(mesh("black", "wall.obj")), spots}}) {
    const auto scene =
        scene_with(cube_scene(10000, objects, lights) +
                       R"(, "meters": [{"name": "m", "irradiance": {"point": [1, 0, 0], "normal": [1, 0, 0]}}])",
                   {{"cube.obj", kCube}, {"wall.obj", box(3, 3.1, -20, 20, -20, 20)}});
    const MeterReading reading = read_meters(scene, 1).front();
    EXPECT_NEAR(reading.value, 100 / (4 * M_PI), 1e-3) << objects << lights;  // the meter is slightly off the surface
    EXPECT_LE(reading.half_width, 1e-3) << objects << lights;
  }
}

/// The middle of the cube's right side, as seen by a camera: red, pixel by pixel, of half A.
std::vector<double> right_side(double emitter_watt) {
  const auto scene = TestScene::from_text(
      R"({"camera": {"eye": [6, 3, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 30},
          "film": {"width": 64, "height": 64}, )" +
          cube_scene(emitter_watt, also(kEmitter), "") + "}",
      {{"cube.obj", kCube}});
  const HalfImages image = scene.render({"path", 9, 0}, 2, {40, 33, 4, 4});
  std::vector<double> out;
  for (std::size_t i = 0; i < image.a.size(); i += 3) {
    out.push_back(image.a[i]);
  }
  return out;
}

TEST(UnequalLights, APictureOfTheRightSideDoesNotDependOnALightOnTheLeft) {
  const std::vector<double> weak = right_side(1e-6), strong = right_side(10000);
  ASSERT_EQ(weak.size(), 16u);
  for (std::size_t i = 0; i < weak.size(); ++i) {
    EXPECT_GT(weak[i], 0.1);
    EXPECT_NEAR(strong[i], weak[i], 1e-5 * weak[i]);
  }
}

TEST(UnequalLights, AWeakOneAmongManyIsNotStarvedByStrongOnesBehindAWall) {
  // One light of 1 W in the open, and more of 10 kW behind a black wall. The even share bounds the relative variance.
  for (const int hidden : {7, 15}) {
    std::string lights = R"({"point": {"position": [0, 0, 1]}, "strength": {"watt": 1}})";
    for (int i = 0; i < hidden; ++i) {
      lights += fmt::format(R"(, {{"point": {{"position": [{}, 0, 4]}}, "strength": {{"watt": 1e4}}}})", i - 3);
    }
    const auto scene = scene_with(fmt::format(R"("materials": [{}], "objects": [{}], "lights": [{}],
             "meters": [{{"name": "m", "irradiance": {{"point": [0, 0, 0], "normal": [0, 0, 1]}}}}])",
                                              diffuse("black", 0), mesh("black", "wall.obj"), lights),
                                  {{"wall.obj", box(-40, 40, -40, 40, 2, 2.1)}});
    const MeterReading reading = read_meters(scene, 3).front();
    constexpr double kSamples = 64 * 64 * 8;
    const double bound = std::sqrt(((hidden + 1) / LightChoice::kUniformShare - 1) / kSamples);
    const double exact = 1 / (4 * M_PI);
    EXPECT_LE(reading.half_width / 1.96, 1.2 * bound * exact) << hidden;
    EXPECT_NEAR(reading.value, exact, 5 * bound * exact) << hidden;
  }
}

/// Two rooms with a wall between them. The camera is in the right one. Each has `lights` points below its ceiling. Those
/// of the left room are `stronger` times as strong.
TestScene two_rooms(int lights, double stronger, const std::string& meters = "",
                    const std::string& grey = diffuse("grey", 0.6)) {
  std::string points;
  for (int i = 0; i < lights; ++i) {
    for (const int room : {0, 1}) {
      const double intensity = (room == 0 ? stronger : 1) * 8 / lights;
      if (intensity > 0) {
        points +=
            fmt::format(R"({}{{"point": {{"position": [{}, 2.7, {}], "intensity": {}}}}})", points.empty() ? "" : ", ",
                        5 * room + 0.8 + 0.37 * (i % 10), 0.8 + 0.37 * (3 * i % 10 + i / 10 * 0.03), gray(intensity));
      }
    }
  }
  return TestScene::from_text(
      fmt::format(R"({{"camera": {{"eye": [9.5, 1.6, 4.5], "look_at": [6, 1.2, 1.5], "vertical_fov_degrees": 65}},
                       "film": {{"width": 48, "height": 32}},
                       "materials": [{}], "objects": [{}, {}], "lights": [{}], "meters": [{}]}})",
                  grey, mesh("grey", "rooms.obj"), mesh("grey", "wall.obj"), points, meters),
      {{"rooms.obj", box(0, 10, 0, 3, 0, 5)}, {"wall.obj", box(4.95, 5.05, -0.1, 3.1, -0.1, 5.1)}});
}

/// The mean over all pixels of the variance over the square of the value.
double relative_variance(const HalfImages& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.a.size(); ++i) {
    sum += image.variance(i) / (image.mean(i) * image.mean(i)) / static_cast<double>(image.a.size());
  }
  return sum;
}

TEST(UnequalLights, StrongOnesBehindAWallAddLittleNoise) {
  // Without learned visibilities, the variances are 13 and 60 times those without the lights behind the wall.
  for (const int lights : {8, 100}) {
    const HalfImages alone = two_rooms(lights, 0).render({"path", 3, 0}, 4),
                     both = two_rooms(lights, 1000).render({"path", 3, 0}, 4);
    EXPECT_LT(relative_variance(both), 3 * relative_variance(alone)) << lights;
    const Estimate expected = mean_of(alone, 0), seen = mean_of(both, 0);
    EXPECT_NEAR(seen.value, expected.value, 5 * std::hypot(seen.standard_error, expected.standard_error)) << lights;
  }
}

/// The probability that a place on the floor draws a light of the left room.
double share_of_the_left_room(const TestScene& rooms, double x) {
  const std::shared_ptr<const CompiledScene> scene = rooms.compiled();
  const V8 p = broadcast(Vec3(scene->frame().to_frame({x, 0.01, 2.5})));
  double left = 0, right = 0;
  for (std::uint32_t i = 0; i < 16; ++i) {  // one in each room by turns
    alignas(32) float pmf[8];
    scene->lights().choice_pmf(p, U8(i), M8(true)).store(pmf);
    (i % 2 == 0 ? left : right) += pmf[0];
  }
  EXPECT_NEAR(left + right, 1, 1e-5);
  return left;
}

TEST(UnequalLights, VisibilitiesAreLearnedAtMetersToo) {
  // The camera is in the right room. Weak lights are in the left one.
  const std::string meter = R"({"name": "m", "irradiance": {"point": [2, 0.01, 2.5], "normal": [0, 1, 0]}})";
  EXPECT_GT(share_of_the_left_room(two_rooms(8, 1e-3, meter), 2), 0.5);
  EXPECT_LT(share_of_the_left_room(two_rooms(8, 1e-3, meter), 7), 0.2);
  EXPECT_LT(share_of_the_left_room(two_rooms(8, 1e-3), 2), 0.3);
}

TEST(UnequalLights, NothingIsLearnedBelowLeaves) {
  // Which of 16 equal lights arrives below a sheet of small holes differs from place to place.
  std::string leaves, lights;
  int quads = 0;
  for (int x = 0; x < 40; ++x) {
    for (int z = 0; z < 40; ++z) {
      if (mix(static_cast<std::uint32_t>(40 * x + z)) % 4 != 0) {
        leaves += fmt::format("v {0} 1 {1}\nv {2} 1 {1}\nv {2} 1 {3}\nv {0} 1 {3}\nf {4} {5} {6} {7}\n", 0.1 * x - 2,
                              0.1 * z - 2, 0.1 * x - 1.9, 0.1 * z - 1.9, 4 * quads + 1, 4 * quads + 2, 4 * quads + 3,
                              4 * quads + 4);
        ++quads;
      }
    }
  }
  for (int i = 0; i < 16; ++i) {
    lights += fmt::format(R"({}{{"point": {{"position": [{}, 3, {}], "intensity": {}}}}})", i == 0 ? "" : ", ",
                          i % 4 - 1.5, i / 4 - 1.5, gray(1));
  }
  const auto scene = TestScene::from_text(
      fmt::format(R"({{"camera": {{"eye": [0, 0.9, 0.01], "look_at": [0, 0, 0], "vertical_fov_degrees": 120}},
                       "film": {{"width": 32, "height": 32}},
                       "materials": [{}], "objects": [{}, {}], "lights": [{}]}})",
                  diffuse("grey", 0.5), mesh("grey", "leaves.obj"), mesh("grey", "floor.obj"), lights),
      {{"leaves.obj", leaves}, {"floor.obj", "v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3 4\n"}});
  EXPECT_TRUE(scene.compiled()->lights().needs_choice());
  EXPECT_FALSE(scene.compiled()->lights().choice().has_visibility());
}

TEST(UnequalLights, VisibilitiesAreLearnedWhereTheyMatterAlone) {
  EXPECT_FALSE(two_rooms(8, 0).compiled()->lights().choice().has_visibility());
  const TestScene rooms = two_rooms(8, 1000);
  EXPECT_TRUE(rooms.compiled()->lights().choice().has_visibility());
  EXPECT_LT(share_of_the_left_room(rooms, 7), 0.5);  // without visibilities it would be about 0.9
}

TEST(UnequalLights, NothingIsLearnedWhereLightCrossesSheets) {
  const std::string paper = named(
      "grey", R"("diffuse": {"reflectance": {"rgb": [0.6, 0.6, 0.6]}, "transmittance": {"rgb": [0.2, 0.2, 0.2]}})");
  EXPECT_FALSE(two_rooms(8, 1000, "", paper).compiled()->lights().choice().has_visibility());
}

}  // namespace
}  // namespace lightmill::test
