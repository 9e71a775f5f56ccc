// The failure atlas for lights: shrinking, many, at and in surfaces, grazing, and environments of one bright pixel.
#include "tests/analytic/meter_text.h"
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/light_scenes.h"
#include "tests/support/read_image.h"

namespace lightmill::test {
namespace {

std::string emitter_of(const std::string& emission) {
  return fmt::format(R"({{"name": "lamp", "diffuse": {{"reflectance": {}}}, {}}})", gray(0), emission);
}
std::string point_light(const std::string& position, double intensity) {
  return fmt::format(R"({{"point": {{"position": {}, "intensity": {}}}}})", position, gray(intensity));
}

/// The value of a white floor (y = 0) at the origin.
Estimate floor_under(const std::string& objects, const std::string& materials, const std::string& lights,
                     const std::string& method = "path", std::uint32_t level = 8,
                     const std::map<std::string, std::string>& more_files = {}) {
  std::map<std::string, std::string> files = more_files;
  files["floor.obj"] = plane(20, 0, true);
  const auto scene = TestScene::from_text(
      document(kDown, 0.01, 8, diffuse("floor", 1) + materials, mesh("floor", "floor.obj") + objects, lights), files);
  return mean_of(clean_picture(scene, method, level, 1), 0);
}

// ---- size ----

TEST(Shrinking, ASphereOfConstantPowerBecomesAPoint) {
  // 8 W give an intensity of 2/π: E = I cosθ/d², from (1, 2, 0) I · 2/5^1.5. A sphere of any size gives it.
  const double exact = 8 / (4 * M_PI) * 2 / std::pow(5, 1.5) / M_PI;
  for (const double radius : {1.0, 0.1, 1e-2, 1e-4, 1e-6, 1e-7, 1e-9, 1e-15}) {
    const std::string ball = also(sphere("lamp", "[1, 2, 0]", radius));
    const std::string watt = also(emitter_of(R"("emission_strength": {"watt": 8})"));
    SCOPED_TRACE(radius);
    expect_answer(floor_under(ball, watt, "", "path"), exact, 5e-3);
    EXPECT_NEAR(floor_under(ball, watt, "", "raycast", 1).value, exact, 1e-4 * exact);
  }
  const Estimate point =
      floor_under("", "", R"({"point": {"position": [1, 2, 0]}, "strength": {"watt": 8}})", "path", 1);
  EXPECT_NEAR(point.value, exact, 1e-4 * exact);
}

TEST(Shrinking, ASquareOfConstantPowerBecomesACosineLight) {
  // Φ/π along the normal: E = Φ/π cos²θ/d², from height 2 at 45°.
  const double exact = 8 / M_PI * 0.5 / 8 / M_PI;
  for (const double side : {0.1, 1e-2, 1e-4, 1e-6}) {
    const std::string watt = also(emitter_of(R"("emission_strength": {"watt": 8})"));
    const std::map<std::string, std::string> files{{"lamp.obj", polygon({{2 - side / 2, 2, -side / 2},
                                                                         {2 + side / 2, 2, -side / 2},
                                                                         {2 + side / 2, 2, side / 2},
                                                                         {2 - side / 2, 2, side / 2}})}};
    SCOPED_TRACE(side);
    const Estimate seen = floor_under(also(mesh("lamp", "lamp.obj")), watt, "", "path", 8, files);
    // Single precision knows corners at distance 2 to 1e-7. It knows sides of 1e-6, and so the area, to a tenth.
    EXPECT_NEAR(seen.value, exact, (side * side + 1e-4) * exact + 5 * seen.standard_error) << side;
    EXPECT_NEAR(floor_under(also(mesh("lamp", "lamp.obj")), watt, "", "raycast", 1, files).value, exact, 1e-3 * exact)
        << side;
  }
}

TEST(Shrinking, PowerWithoutAreaIsRefused) {
  const std::string watt = also(emitter_of(R"("emission_strength": {"watt": 8})"));
  const auto why = [&](const std::string& object, const std::string& obj) {
    return refusal(document(kDown, 60, 8, diffuse("floor", 1) + watt, mesh("floor", "floor.obj") + object),
                   {{"floor.obj", plane(20, 0, true)}, {"lamp.obj", obj}});
  };
  const std::string expected =
      "materials[1] \"lamp\": a power needs a surface whose area is finite and above zero in single precision, but "
      "there is none";
  const std::string square = polygon({{2, 2, 0}, {2 + 1e-9, 2, 0}, {2 + 1e-9, 2, 1e-9}, {2, 2, 1e-9}});
  EXPECT_NE(why(also(mesh("lamp", "lamp.obj")), "v 0 1 0\nv 1 1 0\nf 1 2 2\n").find("have no area"), std::string::npos);
  EXPECT_EQ(why(also(mesh("lamp", "lamp.obj")), square), expected);
  EXPECT_EQ(why(also(sphere("lamp", "[0, 3, 0]", 1e-25)), ""), expected);
  EXPECT_NE(
      why(also(plane_shape("lamp", "[0, 5, 0]", "[0, -1, 0]")), "").find("objects[1].plane: its material \"lamp\""),
      std::string::npos);
  // One surface is enough. A material without objects radiates nothing.
  EXPECT_EQ(why(also(mesh("lamp", "lamp.obj")) + also(sphere("lamp", "[0, 3, 0]", 1)), square), "");
  EXPECT_EQ(why("", ""), "");
}

// ---- number ----

TEST(ManyLights, AHundredThousandPointsAddUp) {
  const ManyPoints points = many_points(100'000);
  expect_answer(floor_under("", "", points.lights, "path", 9), points.radiance, 1e-2);
  const Estimate all = floor_under("", "", points.lights, "raycast", 1);
  EXPECT_NEAR(all.value, points.radiance, 1e-3 * points.radiance);
}

TEST(ManyLights, AHundredThousandEmissiveTrianglesAddUp) {
  // A ceiling of radiance 1 in 2 × 225² pieces equals one square. Its form factor is that from below its middle.
  constexpr int kSide = 224;
  std::string ceiling;
  for (int i = 0; i <= kSide; ++i) {
    for (int j = 0; j <= kSide; ++j) {
      fmt::format_to(std::back_inserter(ceiling), "v {:.17g} 1 {:.17g}\n", static_cast<double>(i) / kSide - 0.5,
                     static_cast<double>(j) / kSide - 0.5);
    }
  }
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const int a = i * (kSide + 1) + j + 1, b = a + kSide + 1;
      fmt::format_to(std::back_inserter(ceiling), "f {} {} {}\nf {} {} {}\n", a + 1, a, b, b, b + 1, a + 1);
    }
  }
  expect_answer(
      floor_under(also(mesh("lamp", "lamp.obj")), also(diffuse("lamp", 0, 1)), "", "path", 10, {{"lamp.obj", ceiling}}),
      0.2394565, 5e-3);
}

TEST(ManyLights, DimOnesBesideAGlaringOneCount) {
  // A hidden light of 100 W/sr beside a visible one of 1 W/sr. Both are sampled, so the hidden one adds no noise.
  const std::string card = also(sphere("floor", "[0, 4, 0]", 0.5));
  const std::string lights = glaring_and_dim();
  for (const char* method : {"path", "raycast"}) {
    EXPECT_NEAR(floor_under(card, "", lights, method, 4).value, 1 / M_PI, 1e-4) << method;
  }
}

// ---- place ----

TEST(Place, LightsAtASurfaceLightWhatTheyFace) {
  // In the plane of the floor, light arrives at a right angle to the normal and counts nothing. Just above it E = I
  // h/d³.
  for (const double height : {0.0, 1e-3, -1e-3}) {
    const double d = std::sqrt(1 + height * height);
    for (const std::string method : {"path", "raycast"}) {
      const double seen = floor_under("", "", point_light(fmt::format("[1, {}, 0]", height), 1), method, 4).value;
      EXPECT_NEAR(seen, height > 0 ? height / d / d / d / M_PI : 0, 1e-6) << method << height;
    }
  }
  // Directly on the floor, seen there and around: all values are finite.
  for (const std::string method : {"path", "raycast", "whitted"}) {
    for (const std::string position : {"[0, 0, 0]", "[0, 1e-7, 0]", "[0, -1e-7, 0]", "[0, 1e-30, 0]"}) {
      const auto scene =
          TestScene::from_text(document(R"("eye": [0, 1, 0.01], "look_at": [0, 0, 0])", 60, 17, diffuse("floor", 1),
                                        mesh("floor", "floor.obj"), point_light(position, 1)),
                               {{"floor.obj", plane(20, 0, true)}});
      const HalfImages image = clean_picture(scene, method, 4, 1);
      EXPECT_LT(image.mean(0), 1e-4) << method << position;
    }
  }
}

TEST(Place, LightsInsideObjectsStayInside) {
  for (const std::string method : {"path", "raycast"}) {
    EXPECT_EQ(floor_under(also(sphere("floor", "[0, 2, 0]", 1)), "", point_light("[0, 2.3, 0]", 5), method, 4).value,
              0);
    EXPECT_EQ(floor_under(also(sphere("floor", "[0, 2, 0]", 1)) + also(sphere("lamp", "[0, 2.3, 0]", 0.2)),
                          also(diffuse("lamp", 0, 5)), "", method, 4)
                  .value,
              0);
    // A ball of air blocks nothing.
    EXPECT_NEAR(floor_under(also(sphere("air", "[0, 2, 0]", 1)), also(R"({"name": "air", "dielectric": {"ior": 1}})"),
                            point_light("[0, 2, 0]", 4), method, 4)
                    .value,
                1 / M_PI, 1e-4);
  }
}

TEST(Place, AnEmitterInAGlassBallShinesByTheTransmittance) {
  // An emitter of radius 0.5 in a ball of radius 1. Its light never meets the glass beyond the critical angle.
  // Reflected light returns to the emitter, which is black. So a line of sight that passes the middle at b sees (1 −
  // R(sin⁻¹ b)) L, up to b = 0.5 n. From a distance d this is E = 2πL/d² ∫ (1 − R) b db.
  const double n = 1.5, d = 2;
  double exact = 0;
  constexpr int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) {
    const double b = 0.5 * n * (i + 0.5) / kSteps, ct = std::sqrt(1 - b * b / n / n), c = std::sqrt(1 - b * b);
    const double s = (c - n * ct) / (c + n * ct), p = (n * c - ct) / (n * c + ct);
    exact += (1 - (s * s + p * p) / 2) * b * 0.5 * n / kSteps;
  }
  const auto scene = scene_with(fmt::format(
      R"("materials": [{}, {}], "objects": [{}, {}],
         "meters": [{{"name": "m", "irradiance": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}])",
      R"({"name": "glass", "dielectric": {"ior": 1.5}})", diffuse("lamp", 0, 1), sphere("glass", "[0, 2, 0]", 1),
      sphere("lamp", "[0, 2, 0]", 0.5)));
  expect_reading(read_meters(scene, 6).front(), 2 * M_PI / (n * n * d * d) * exact, 3e-2);
}

TEST(Place, GrazingSunsGiveTheSineOfTheirElevation) {
  for (const double degrees : {0.0, 1e-5, 1e-3, 0.1, 180.0, 270.0}) {
    const double sine = std::sin(degrees * M_PI / 180);
    const std::string sun =
        fmt::format(R"({{"directional": {{"direction": [{:.17g}, {:.17g}, 0], "irradiance": {}}}}})",
                    std::cos(degrees * M_PI / 180), -sine, gray(1000));
    for (const std::string method : {"path", "raycast", "whitted"}) {
      const double seen = floor_under("", "", sun, method, 4).value;
      EXPECT_NEAR(seen, std::max(sine, 0.0) * 1000 / M_PI, 1e-4) << method << degrees;
    }
  }
}

TEST(Place, FarLightsAreSuns) {
  for (const double distance : {1e3, 1e6, 1e9}) {
    const std::string light = point_light(fmt::format("[0, {}, 0]", distance), 2 * distance * distance);
    for (const std::string method : {"path", "raycast"}) {
      EXPECT_NEAR(floor_under("", "", light, method, 2).value, 2 / M_PI, 1e-4) << method << distance;
    }
  }
}

TEST(Spots, ShineFromTheNarrowestConeToAllDirections) {
  const auto under = [](double cutoff, double blend) {
    return floor_under("", "",
                       fmt::format(R"({{"spot": {{"position": [0, 2, 0], "direction": [0, -1, 0], "intensity": {},
                                       "cutoff_degrees": {}, "blend": {}}}}})",
                                   gray(4), cutoff, blend),
                       "path", 4)
        .value;
  };
  EXPECT_NEAR(under(180, 0), 1 / M_PI, 1e-4);
  EXPECT_NEAR(under(180, 1), 1 / M_PI, 1e-4);
  EXPECT_NEAR(under(0.1, 0), 1 / M_PI, 1e-4);
  EXPECT_NEAR(under(0.1, 1), 1 / M_PI, 0.02);  // it falls off from the axis on, and the pixel has a width
  const double narrowest = under(1e-3, 0);     // a disc smaller than the pixel
  EXPECT_GT(narrowest, 0.05 / M_PI);
  EXPECT_LE(narrowest, 1 / M_PI + 1e-4);
  EXPECT_NE(refusal(document(kDown, 60, 8, diffuse("floor", 1), sphere("floor", "[0, 0, 0]", 1),
                             R"({"spot": {"position": [0, 2, 0], "direction": [0, -1, 0], "cutoff_degrees": 1e-6,
                                 "intensity": {"rgb": [1, 1, 1]}}})"))
                .find("lights[0].spot.cutoff_degrees: must be in [0.001, 180], got 1e-06"),
            std::string::npos);
}

TEST(LightStrength, IsRefusedWhenInvalid) {
  const auto why = [](const std::string& light) {
    return refusal(document(kDown, 60, 8, diffuse("floor", 1), sphere("floor", "[0, 0, 0]", 1), light));
  };
  EXPECT_NE(why(R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, -1, 1]}}})")
                .find("lights[0].point.intensity: each component must be in [0, 1e+20], got (1, -1, 1)"),
            std::string::npos);
  EXPECT_NE(why(R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, 1e21, 1]}}})")
                .find("lights[0].point.intensity: each component must be in [0, 1e+20]"),
            std::string::npos);
  EXPECT_NE(why(R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, NaN, 1]}}})").find("scene.json:"),
            std::string::npos);
  EXPECT_NE(why(R"({"directional": {"direction": [0, 0, 0], "irradiance": {"rgb": [1, 1, 1]}}})")
                .find("lights[0].directional.direction: must not be zero"),
            std::string::npos);
  EXPECT_NE(why(sky(1) + also(sky(1))).find("lights[1].environment: at most one light can be an environment"),
            std::string::npos);
}

TEST(LightStrength, OverflowIsCountedAndLeftOut) {
  // 1e20 W/sr from a distance of 1e-9 overflow single precision. The samples count as zero, and are counted.
  const auto scene =
      TestScene::from_text(document(kDown, 0.01, 8, diffuse("floor", 1), mesh("floor", "floor.obj"),
                                    point_light("[0, 0.001, 0]", 1e20) + also(point_light("[0, 1, 0]", 0))),
                           {{"floor.obj", plane(20, 0, true)}});
  const HalfImages image = scene.render({"path", 1, 1}, 4);
  for (const double value : image.a) {
    ASSERT_TRUE(std::isfinite(value));
  }
}

// ---- environments ----

TEST(EnvironmentImage, OneBrightPixelLightsFromItsDirection) {
  // In the middle, at the seam on both sides, and at both poles. Some are turned.
  struct Case {
    int x, y;
    Vec3d normal;
    double rotation_degrees;
  };
  for (const Case& c : {Case{20, 6, {0.6, 0.7, 0.1}, 0},
                        {0, 8, {-1, 0.3, 0}, 0},
                        {31, 8, {-1, 0.3, 0}, 0},
                        {0, 8, {1, 0.3, 0}, 180},
                        {31, 7, {0.3, 0.3, 1}, -90},
                        {5, 0, {0, 1, 0}, 0},
                        {5, 15, {0, -1, 0.4}, 33},
                        {16, 7, {1, 0.1, 0.2}, 360}}) {
    const Vec3d n = glm::normalize(c.normal);
    const auto scene = TestScene::from_text(
        fmt::format(R"({{"camera": {{"eye": [0, 0, 50], "look_at": [0, 0, 0], "vertical_fov_degrees": 10}},
            "materials": [{}], "objects": [{}],
            "lights": [{{"environment": {{"file": "sky.exr", "rotation_degrees": {}}}}}],
            "meters": [{{"name": "m", "irradiance": {{"point": [0, 0, 0], "normal": [{}, {}, {}]}}}}]}})",
                    diffuse("floor", 0), sphere("floor", fmt::format("[{}, {}, {}]", -n.x, -n.y, -n.z), 0.01),
                    c.rotation_degrees, n.x, n.y, n.z),
        {{"sky.exr", one_pixel(32, 16, c.x, c.y, 1e6f)}}, read_image);
    const auto readings = read_meters(scene, 6, 1, read_image);
    SCOPED_TRACE(fmt::format("{} {} {}", c.x, c.y, c.rotation_degrees));
    expect_reading(readings.front(), irradiance_of_pixel(32, 16, c.x, c.y, 1e6, n, c.rotation_degrees * M_PI / 180),
                   2e-2);
  }
}

TEST(EnvironmentImage, HasNoVisibleSeamOrPoles) {
  // A uniform image gives a uniform picture at any size, also in a mirror ball.
  for (const auto& [width, height] : {std::pair(1, 1), {2, 1}, {3, 5}, {7, 2}, {64, 32}}) {
    for (const std::string method : {"path", "raycast", "whitted"}) {
      for (const std::string look : {"[-1, 0, 0]", "[0.0001, 1, 0]", "[0.0001, -1, 0]", "[1, 0, 0]"}) {
        const auto scene = TestScene::from_text(mirror_ball_in_a_sky(look),
                                                {{"sky.exr", one_pixel(width, height, 0, 0, 0.5f, 0.5f)}}, read_image);
        SCOPED_TRACE(method + look);
        expect_even(clean_picture(scene, method, 2), method == "raycast" ? 0.25 : 0.5,
                    method == "raycast" ? 0.2501 : 1e-4);
      }
    }
  }
}

TEST(EnvironmentImage, KeepsBlackAndHugeValues) {
  for (const float value : {0.0f, 1e-30f, 1e10f}) {
    const auto scene =
        TestScene::from_text(document(R"("eye": [0, 1, 0.01], "look_at": [0, 0, 0])", 1, 8, diffuse("floor", 0.5),
                                      sphere("floor", "[0, -5, 0]", 5), R"({"environment": {"file": "sky.exr"}})"),
                             {{"sky.exr", one_pixel(8, 4, 3, 1, value, value)}}, read_image);
    expect_even(clean_picture(scene, "path", 4), 0.5 * static_cast<double>(value), 1e-4 * static_cast<double>(value));
  }
}

TEST(EnvironmentImage, IsRefusedWhenInvalid) {
  const std::string text = document(kDown, 60, 8, diffuse("floor", 1), sphere("floor", "[0, 0, 0]", 1),
                                    R"({"name": "world", "environment": {"file": "sky.exr"}})");
  const auto why = [&](const std::map<std::string, std::string>& files) { return refusal(text, files, read_image); };
  EXPECT_NE(why({}).find("lights[0].environment.file: "), std::string::npos) << why({});
  EXPECT_NE(why({{"sky.exr", "no picture"}}).find("lights[0] \"world\": sky.exr: "), std::string::npos)
      << why({{"sky.exr", "no picture"}});
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(why({{"sky.exr", one_pixel(8, 4, 3, 1, value)}}),
              "lights[0] \"world\": sky.exr: pixel (3, 1) is not finite");
  }
}

}  // namespace
}  // namespace lightmill::test
