// Known figures of radiometry, read by virtual meters in public scene documents: emitters of a given power, and a
// uniform sky.
#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string irradiance(const std::string& point, const std::string& normal) {
  return fmt::format(R"({{"name": "at {0}", "irradiance": {{"point": {0}, "normal": {1}}}}})", point, normal);
}

/// Flux meters on the six sides of a cube around the origin, facing inwards. All light emitted inside arrives there.
std::string box_of_meters(double side) {
  std::string meters;
  const auto text = [](const Vec3d& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); };
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3d u(0), v(0), n(0);
      n[axis] = -sign;
      u[(axis + 1) % 3] = side;
      v[(axis + 2) % 3] = -sign * side;  // u × v points along n
      meters +=
          fmt::format(R"({}{{"name": "{}", "flux": {{"patch": {{"corner": {}, "edge1": {}, "edge2": {}}}}}}})",
                      meters.empty() ? "" : ", ", meters.size(), text((-n * side - u - v) / 2.0), text(u), text(v));
    }
  }
  return meters;
}

/// An object that no meter sees. A scene must have one.
constexpr const char* kMote = R"("materials": [{"name": "black", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}}],
    "objects": [{"material": "black", "sphere": {"center": [0, -30, 0], "radius": 0.01}}])";

std::string emitter_material(const std::string& emission) {
  return fmt::format(R"("materials": [{{"name": "lamp", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}}, {}}}])",
                     emission);
}

// A bulb of 2.4 V and 0.7 A: 1.68 W, 0.13369 W/sr, 504 J in five minutes. Then another one.
TEST(Radiometry, APointEmitsItsWatts) {
  for (const auto& [watt, intensity] : {std::pair(2.4 * 0.7, 0.13369), {60.0, 60 / (4 * M_PI)}}) {
    const auto scene = scene_with(fmt::format(
        R"({}, "lights": [{{"point": {{"position": [0, 0, 0]}}, "strength": {{"watt": {}}}}}],
                       "meters": [{}, {}, {}])",
        kMote, watt, irradiance("[1, 0, 0]", "[-1, 0, 0]"), irradiance("[0, 0, -0.5]", "[0, 0, 1]"), box_of_meters(2)));
    auto readings = read_meters(scene, 6);
    EXPECT_NEAR(readings[0].value, intensity, 4e-5 * intensity);
    EXPECT_NEAR(readings[1].value, 4 * intensity, 4e-5 * 4 * intensity);
    EXPECT_NEAR(readings[0].photometric, 683 * intensity, 683 * 4e-5 * intensity);
    const MeterReading all = sum_of({readings.begin() + 2, readings.end()});
    expect_reading(all, watt, 2e-3);
    if (watt < 2) {
      EXPECT_NEAR(all.value * 5 * 60, 504, 300 * 4.5 / 1.96 * all.half_width + 0.01);
    }
  }
}

// As a sphere of diameter 1 cm its exitance is 5347.6 W/m².
TEST(Radiometry, ASphereEmitsItsWatts) {
  for (const auto& [watt, diameter, exitance] :
       {std::tuple(1.68, 0.01, 5347.6), {100.0, 0.2, 100 / (M_PI * 0.2 * 0.2)}}) {
    const auto scene = scene_with(
        fmt::format(R"({}, "objects": [{{"material": "lamp", "sphere": {{"center": [0, 0, 0], "radius": {}}}}}],
                       "meters": [{}, {}, {{"name": "look", "radiance": {{"point": [0, 0, 3], "direction": [0, 0, -1]}}}},
                                  {}])",
                    emitter_material(fmt::format(R"("emission_strength": {{"watt": {}}})", watt)), diameter / 2,
                    irradiance(fmt::format("[{}, 0, 0]", diameter), "[-1, 0, 0]"),
                    irradiance(fmt::format("[{}, 0, 0]", 0.505 * diameter), "[-1, 0, 0]"), box_of_meters(1)));
    const auto readings = read_meters(scene, 7);
    expect_reading(readings[0], exitance / 4, 2e-3);
    expect_reading(readings[1], exitance / (1.01 * 1.01), 3e-3);  // away from its surface
    EXPECT_NEAR(readings[2].value, exitance / M_PI, 2e-5 * exitance);
    expect_reading(sum_of({readings.begin() + 3, readings.end()}), watt, 3e-3);
  }
}

// 0.1 × 0.1 m with L = 5000 gives 15,708 W/m² and 157.080 W; with L = 6000 cos θ 125.664 W, as 2π L₀ A/(n + 2).
TEST(Radiometry, ASquareEmitsItsWattsWithAndWithoutACosineProfile) {
  struct Case {
    double side, radiance, exponent, watt;
  };
  for (const Case& c : {Case{0.1, 5000, 0, 157.080}, {0.1, 6000, 1, 125.664}, {0.4, 30, 3, 2 * M_PI * 30 * 0.16 / 5}}) {
    const double corner = -0.52 * c.side, gap = 0.01 * c.side;
    const auto scene = scene_with(
        fmt::format(
            R"({0}, "objects": [{{"material": "lamp", "mesh": {{"file": "lamp.obj"}}}}],
               "meters": [{{"name": "near", "patch": {{"corner": [{1}, {2}, {1}], "edge1": [{3}, 0, 0], "edge2": [0, 0, {3}]}}}},
                          {{"name": "look", "radiance": {{"point": [0.1, 1, 1], "direction": [-0.1, -1, -1]}}}}, {4}])",
            emitter_material(fmt::format(R"("emission": {}, "emission_exponent": {})", gray(c.radiance), c.exponent)),
            corner, gap, c.side, box_of_meters(1)),
        {{"lamp.obj", horizontal_rectangle(corner, corner + c.side, corner, corner + c.side, 0, true)}});
    const auto readings = read_meters(scene, 7);
    if (c.exponent == 0) {  // facing it closely: its exitance, except for what passes beside the meter
      expect_reading(readings[0], 15708 * parallel_form_factor(c.side, c.side, gap), 5e-3);
    }
    const double cosine = std::pow(1 / std::sqrt(2.01), c.exponent);
    EXPECT_NEAR(readings[1].value, c.radiance * cosine, 3e-5 * c.radiance);
    expect_reading(sum_of({readings.begin() + 2, readings.end()}), c.watt, 5e-3);
  }
}

TEST(Radiometry, AUniformSkyGivesPiTimesItsRadiance) {
  for (const double radiance : {1.0, 0.3, 250.0}) {
    const auto scene = scene_with(
        fmt::format(R"({}, "lights": [{{"environment": {{"radiance": {}}}}}], "meters": [{}, {},
            {{"name": "patch", "patch": {{"corner": [0, 0, 0], "edge1": [2, 0, 0], "edge2": [0, 0, -3]}}}},
            {{"name": "flux", "flux": {{"patch": {{"corner": [0, 0, 0], "edge1": [2, 0, 0], "edge2": [0, 0, -3]}}}}}},
            {{"name": "look", "radiance": {{"point": [1, 2, 3], "direction": [1, 2, -3]}}}}])",
                    kMote, gray(radiance), irradiance("[0, 1, 2]", "[0, 1, 0]"), irradiance("[3, 1, 2]", "[1, 2, 3]")));
    const auto readings = read_meters(scene, 2);
    for (const auto& [i, expected] :
         {std::pair<std::size_t, double>(0, M_PI), {1, M_PI}, {2, M_PI}, {3, 6 * M_PI}, {4, 1}}) {
      expect_reading(readings[i], expected * radiance, 1e-5);
    }
  }
  // In photometric units: 1000 cd/m² are 1000 π lx.
  const auto scene = scene_with(
      fmt::format(R"({}, "lights": [{{"environment": {{}}, "strength": {{"candela_per_square_metre": 1000}}}}],
                                "meters": [{}])",
                  kMote, irradiance("[0, 1, 2]", "[0, 1, 0]")));
  EXPECT_NEAR(read_meters(scene, 2).front().photometric, 1000 * M_PI, 0.05);
}

TEST(Radiometry, InAFurnaceAMeterReadsPiOverOneMinusTheAlbedo) {
  for (const double albedo : {0.5, 0.8, 0.3}) {
    const auto scene =
        scene_with(fmt::format(R"("materials": [{}], "objects": [{}], "meters": [{}, {}])", diffuse("wall", albedo, 1),
                               sphere("wall", "[0, 0, 0]", 1, true), irradiance("[0.2, 0.3, 0]", "[1, 0, 0]"),
                               R"({"name": "look", "radiance": {"point": [0.1, 0.2, 0], "direction": [0, 1, 1]}})"));
    const auto readings = read_meters(scene, 4);
    expect_reading(readings[0], M_PI / (1 - albedo), 2e-2);
    expect_reading(readings[1], 1 / (1 - albedo), 2e-2);
  }
}

}  // namespace
}  // namespace lightmill::test
