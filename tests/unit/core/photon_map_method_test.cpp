// The photon map, shown as points.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/methods/spec/method_spec.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// A light that shines down on all of a square floor. The camera sees the floor from above, with or without a slab
/// between.
TestScene floor_under_light(const std::string& materials = "", const std::string& objects = "",
                            const std::map<std::string, std::string>& files = {}) {
  auto all = files;
  all["floor.obj"] = horizontal_square(2, 0, true);
  return TestScene::from_text(
      document(R"("eye": [0, 4, 0], "look_at": [0, 0, 0], "up": [0, 0, 1])", 40, 64, diffuse("floor", 0.5) + materials,
               mesh("floor", "floor.obj") + objects,
               R"({"spot": {"position": [0, 3, 0], "direction": [0, -1, 0], "intensity": {"rgb": [2, 2, 2]},
                   "cutoff_degrees": 15, "blend": 0}})"),
      all);
}

double sum_of(const HalfImages& image, int channel = 0) {
  double sum = 0;
  for (std::size_t i = static_cast<std::size_t>(channel); i < image.a.size(); i += 3) {
    sum += image.mean(i);
  }
  return sum;
}

// All photons with power fall on the floor and are seen, so the picture's sum is their number. Light within 15 degrees
// of the axis falls within 0.81 of the middle. The light is inside the sphere around the scene, so photons start in all
// directions alike. The light's cone has the share (1 − cos 15°)/2 of them.
TEST(PhotonMapMethod, CountsEachPhotonOnAFloorOnce) {
  const TestScene scene = floor_under_light();
  const HalfImages image = scene.render({"photon-map:photons=100000", 1, 1}, 1);
  double largest = 0;
  for (std::size_t i = 0; i < image.a.size(); ++i) {
    EXPECT_NEAR(image.mean(i), std::round(image.mean(i)), 1e-3) << "each photon is 1";
    largest = std::max(largest, image.mean(i));
  }
  EXPECT_LT(largest, 200);
  const double expected = 100000 * (1 - std::cos(15 * std::numbers::pi / 180)) / 2;
  EXPECT_NEAR(sum_of(image), expected, 5 * std::sqrt(expected));
}

TEST(PhotonMapMethod, DoesNotDependOnTheNumberOfSamples) {
  const TestScene scene = floor_under_light();
  const HalfImages few = scene.render({"photon-map:photons=2000", 1, 0}, 1);
  const HalfImages many = scene.render({"photon-map:photons=2000", 1, 0}, 4);
  for (std::size_t i = 0; i < few.a.size(); ++i) {
    EXPECT_NEAR(few.mean(i), many.mean(i), 1e-5);
  }
}

TEST(PhotonMapMethod, CausticPhotonsNeedGlass) {
  EXPECT_EQ(sum_of(floor_under_light().render({"photon-map:caustic,photons=2000", 1, 0}, 1)), 0);
  const std::string glass = also(named("glass", R"("dielectric": {"ior": 1.5})"));
  const TestScene ball = floor_under_light(glass, also(sphere("glass", "[0, 1, 0.9]", 0.5)));
  const double caustic = sum_of(ball.render({"photon-map:caustic,photons=2000", 1, 0}, 1));
  EXPECT_GT(caustic, 0);
}

/// Light passes an absorbing slab of index 1 twice: on its way to the floor, and back to the camera above.
TEST(PhotonMapMethod, AbsorptionDarkensPhotonsUnlessDisabled) {
  const std::string amber =
      also(named("amber", R"("dielectric": {"ior": 1}, "interior": {"absorption": {"rgb": [0.1, 1, 0]}})"));
  const std::map<std::string, std::string> slab{{"slab.obj", box(-3, 3, 1, 2, -3, 3)}};
  const TestScene with = floor_under_light(amber, also(mesh("amber", "slab.obj")), slab);
  const HalfImages image = with.render({"photon-map:photons=5000", 1, 1}, 1);
  const double clear = sum_of(image, 2);
  // Rays go down within 15 degrees of the axis, and back within 12: paths of length 1 to 1.04.
  EXPECT_LT(sum_of(image, 0) / clear, std::exp(-0.2));
  EXPECT_GT(sum_of(image, 0) / clear, std::exp(-0.2 * 1.04));
  EXPECT_LT(sum_of(image, 1) / clear, std::exp(-2.0));
  EXPECT_GT(sum_of(image, 1) / clear, std::exp(-2.0 * 1.04));

  Scene document = with.scene();
  remove_absorption(document);
  const auto compiled = CompiledScene::compile(document, with.assets());
  ASSERT_TRUE(compiled.ok());
  const auto method = make_method(*compiled, {"photon-map:photons=5000,no-absorption", 1, 1});
  ASSERT_TRUE(method.ok());
  const Node node = (*method)->render({0, 0, 64, 64}, {0, 0}, *(*method)->make_workspace());
  const std::span<const float> values(node.values);
  const auto plane = [&](std::size_t channel) {
    double sum = 0;
    for (const float v : values.subspan(channel * 64 * 64, 64 * 64)) {
      sum += v;
    }
    return sum;
  };
  EXPECT_GT(plane(0), 0);
  EXPECT_NEAR(plane(0), plane(1), 1e-6 * plane(0));
  EXPECT_NEAR(plane(0), plane(2), 1e-6 * plane(0));
}

}  // namespace
}  // namespace lightmill::test
