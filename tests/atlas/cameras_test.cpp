// The failure atlas for cameras: cameras without a view are refused, and every other camera sees what is there.
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/material_scenes.h"

namespace lightmill::test {
namespace {

const char* const kMethods[] = {"path", "raycast", "whitted", "preview", "ao"};

/// A document with this camera: a white ball of radius 1 at the origin under a sky of radiance 1.
std::string ball_seen_by(const std::string& camera, int width = 8, int height = 8) {
  return fmt::format(R"({{"camera": {{{}}},
      "film": {{"width": {}, "height": {}, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "materials": [{}], "objects": [{}], "lights": [{}]}})",
                     camera, width, height, diffuse("white", 0.5), sphere("white", "[0, 0, 0]", 1), sky(1));
}
std::string looking(const std::string& eye, const std::string& at, double fov) {
  return fmt::format(R"("eye": {}, "look_at": {}, "vertical_fov_degrees": {:.17g})", eye, at, fov);
}

TEST(Cameras, AreRefusedWithoutAView) {
  const struct {
    std::string camera, why;
  } cases[] = {
      {looking("[1, 2, 3]", "[1, 2, 3]", 40), "camera.look_at: must differ from camera.eye, both are (1, 2, 3)"},
      {looking("[0, 5, 0]", "[0, 0, 0]", 40),
       "camera.up: must not be parallel to the direction from eye to look_at, got (0, 1, 0)"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 40) + R"(, "up": [0, 0, -2])",
       "camera.up: must not be parallel to the direction from eye to look_at, got (0, 0, -2)"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 40) + R"(, "up": [0, 0, 0])", "camera.up: must not be zero"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 0), "camera.vertical_fov_degrees: must be in (0, 180), got 0"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 180), "camera.vertical_fov_degrees: must be in (0, 180), got 180"},
      {looking("[0, 0, 5]", "[0, 0, 0]", -40), "camera.vertical_fov_degrees: must be in (0, 180), got -40"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 40) + R"(, "lens_radius": -1)",
       "camera.lens_radius: must be from 0 to 1000000000000, got -1"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 40) + R"(, "lens_radius": 1, "focus_distance": -2)",
       "camera.focus_distance: must be from 0 to 1000000000000, got -2"},
      {looking("[0, 0, 5]", "[0, 0, 0]", 40) + R"(, "shift_y": -1001)",
       "camera.shift_y: must be from -1000 to 1000, got -1001"},
      {looking("[1e13, 0, 5]", "[0, 0, 0]", 40),
       "camera.eye: coordinates must be finite and at most 1000000000000, got (10000000000000, 0, 5)"}};
  for (const auto& c : cases) {
    const std::string message = refusal(ball_seen_by(c.camera));
    EXPECT_NE(message.find(c.why), std::string::npos) << message;
  }
}

TEST(Cameras, SeeTheMiddleWhenTheyLookNearlyAlongUp) {
  for (const double tilt : {1e-5, 1e-3}) {
    const auto scene = TestScene::from_text(ball_seen_by(looking(fmt::format("[{}, 5, 0]", 5 * tilt), "[0, 0, 0]", 1)));
    for (const char* const method : {"path", "raycast"}) {
      expect_even(clean_picture(scene, method, 3), 0.5, 1e-5);
    }
  }
}

TEST(Cameras, SeeOnePointAtZeroWidth) {
  for (const double fov : {1e-300, 1e-12, 1e-5}) {
    const auto scene = TestScene::from_text(ball_seen_by(looking("[0, 0, 5]", "[0, 0, 0]", fov)));
    for (const char* const method : kMethods) {
      const double ball = std::string_view(method) == "ao" ? 1 : 0.5;
      expect_even(clean_picture(scene, method, 3), ball, 1e-3);
    }
  }
}

TEST(Cameras, SeeASmallBallAtNearly180Degrees) {
  // At 179.9° the film's half height is 1146 at distance 1. The ball, seen at sin⁻¹ 0.2, covers less than a pixel in
  // the middle. Just below 180° all of the film is far to the sides. Odd sizes have a pixel in the middle.
  for (const double fov : {179.0, 179.9, 179.9999999, std::nextafter(180.0, 0.0)}) {
    for (const auto& [width, height] : {std::pair(9, 9), {65536, 1}, {1, 129}, {1, 1}}) {
      const auto scene = TestScene::from_text(ball_seen_by(looking("[0, 0, 5]", "[0, 0, 0]", fov), width, height));
      for (const char* const method : {"path", "raycast", "preview"}) {
        const HalfImages image = clean_picture(scene, method, 1);
        EXPECT_NEAR(image.a.front(), 1, height == 1 && width == 1 ? 0.51 : 1e-5) << method << fov;
        EXPECT_NEAR(image.b.back(), 1, height == 1 && width == 1 ? 0.51 : 1e-5) << method << fov;
      }
    }
  }
}

TEST(Cameras, SeeTheBallAtItsSize) {
  // Its silhouette is a circle of angular radius sin⁻¹(1/d) in a pinhole's plane: area π tan² out of d² (film area).
  for (const double distance : {1.5, 10.0, 1e3, 1e4}) {
    const double tangent = 1 / std::sqrt(distance * distance - 1);
    const double fov = 2 * std::atan(1.25 * tangent) * 180 / M_PI;
    const auto scene =
        TestScene::from_text(ball_seen_by(looking(fmt::format("[0, 0, {}]", distance), "[0, 0, 0]", fov), 32, 32));
    const double covered = M_PI / 4 / (1.25 * 1.25);
    const Estimate mean = mean_of(clean_picture(scene, "path", 8), 0);
    EXPECT_NEAR(mean.value, 1 - 0.5 * covered, 1e-3 + 1e-7 * distance) << distance;
  }
}

TEST(Cameras, SeeOneSideOfASurfaceThatTheyTouch) {
  // The floor is of triangles, a plane or a ball. At the surface each ray sees one side or the other. Just above it the
  // camera sees the sky upwards and the surface downwards.
  const std::map<std::string, std::string> files{{"floor.obj", plane(20, 0, true)}};
  for (const std::string method : {"path", "raycast", "whitted"}) {
    for (const std::string& object : {mesh("white", "floor.obj"), plane_shape("white", "[0, 0, 0]", "[0, 1, 0]"),
                                      sphere("white", "[0, -1, 0]", 1)}) {
      SCOPED_TRACE(method + object);
      const auto seen = [&](double height, const Vec3d& direction) {
        const auto scene = TestScene::from_text(
            document(fmt::format(R"("eye": [0.001, {0}, 0.002], "look_at": [{1}, {2}, {3}], "up": [0.3, 0.2, 1])",
                                 height, 0.001 + direction.x, height + direction.y, 0.002 + direction.z),
                     20, 8, diffuse("white", 0.5), object, sky(1)),
            files);
        return clean_picture(scene, method, 3);
      };
      for (const Vec3d& direction : {Vec3d(0, 1, 0), Vec3d(0, -1, 0), Vec3d(1, 0, 0), Vec3d(1, 1e-7, 0)}) {
        expect_even(seen(0, direction), 0.5, 0.5001);
      }
      expect_even(seen(1e-4, {0, 1, 0}), 1, 1e-5);
      expect_even(seen(1e-4, {0, -1, 0}), 0.5, 1e-5);
    }
  }
}

TEST(Cameras, SeeABrighterSkyInsideGlass) {
  for (const double n : {1.5, 1.1, 2.4}) {
    expect_answer(mean_of(clean_picture(scene_of(camera_in_glass(n)), "path", 8), 0), n * n, 1e-2);
  }
}

TEST(Lenses, ArePinholesAtZeroAndTinyRadii) {
  const auto scene = [](const std::string& lens) {
    return TestScene::from_text(ball_seen_by(looking("[0, 0, 5]", "[0, 0, 0]", 30) + lens, 16, 16));
  };
  const HalfImages pinhole = clean_picture(scene(""), "path", 4);
  EXPECT_EQ(clean_picture(scene(R"(, "lens_radius": 0, "focus_distance": 3)"), "path", 4).a, pinhole.a);
  const HalfImages tiny = clean_picture(scene(R"(, "lens_radius": 1e-12, "focus_distance": 3)"), "path", 4);
  double difference = 0;
  for (std::size_t i = 0; i < tiny.a.size(); ++i) {
    difference += std::abs(tiny.a[i] - pinhole.a[i]);
  }
  EXPECT_LT(difference, 1e-3 * static_cast<double>(tiny.a.size()));
}

TEST(Lenses, SeeAUniformSkyUniformlyAtAnySizeAndFocus) {
  for (const std::string lens :
       {R"(, "lens_radius": 1e-3, "focus_distance": 1e-9)", R"(, "lens_radius": 1, "focus_distance": 1e-6)",
        R"(, "lens_radius": 1e12, "focus_distance": 1)", R"(, "lens_radius": 1e12, "focus_distance": 1e12)",
        R"(, "lens_radius": 0.1, "focus_distance": 1e12)", R"(, "lens_radius": 1e-12, "focus_distance": 1e-300)"}) {
    // A ball of albedo 1 is invisible under a sky of radiance 1.
    std::string text = ball_seen_by(looking("[0, 0, 5]", "[0, 0, 0]", 40) + lens);
    text.replace(text.find("[0.5, 0.5, 0.5]"), 15, "[1, 1, 1]");
    for (const char* const method : {"path", "raycast", "whitted"}) {
      SCOPED_TRACE(lens + method);
      expect_even(clean_picture(TestScene::from_text(text), method, 3), 1, 1e-3);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
