// Photons against exact answers. On these surfaces `ppm` samples no lights, and `vcm` does so among other strategies.
//
// The pixels of a picture share its photons, so standard errors come from the spread of whole pictures over 16 seeds. A
// |z| above 6 is a false alarm once in 40,000 (Student's distribution, 15 degrees of freedom). Each case also states
// how much the gather radius may blur.
#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

constexpr int kSeeds = 16;

/// The mean of the picture's red channel.
Estimate seen_by(const TestScene& scene, const std::string& method, std::uint32_t level, std::uint32_t bounces = 0) {
  double sum = 0, squares = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const HalfImages image = scene.render({method, 70 + seed, bounces}, level);
    EXPECT_EQ(image.non_finite, 0u);
    double mean = 0;
    for (std::size_t i = 0; i < image.a.size(); i += 3) {
      mean += image.mean(i) * 3 / static_cast<double>(image.a.size());
    }
    sum += mean;
    squares += mean * mean;
  }
  const double mean = sum / kSeeds;
  return {mean, std::sqrt(std::max(squares / kSeeds - mean * mean, 0.0) / (kSeeds - 1))};
}

void expect_seen(const Estimate& estimate, double exact, double precision, double blur = 0) {
  EXPECT_LT(estimate.standard_error, precision * exact) << "too much noise to compare";
  EXPECT_NEAR(estimate.value, exact, 6 * estimate.standard_error + (blur + kRounding) * exact);
}

class PhotonAnswers : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(By, PhotonAnswers, ::testing::Values("ppm", "vcm"),
                         [](const auto& info) { return info.param; });

// Photons on a sphere within the straight distance r lie on a cap of area πr², so gathering there has no blur.
TEST_P(PhotonAnswers, AFurnaceOfAlbedoAHasRadianceOneOverOneMinusA) {
  for (const double albedo : {0.5, 0.8}) {
    const auto scene = TestScene::from_text(
        document(kInside, 60, 16, diffuse("wall", albedo, 1), sphere("wall", "[0, 0, 0]", 1, true)));
    expect_seen(seen_by(scene, GetParam() + ":photons=4000", 4), 1 / (1 - albedo), 5e-3);
  }
}

TEST_P(PhotonAnswers, AFurnaceCutAfterSomeBouncesIsThePartialSum) {
  for (const auto& [albedo, bounces, exact] : {std::tuple(0.8, 4u, 3.3616), {0.6, 2u, 1.96}, {0.9, 1u, 1.9}}) {
    const auto scene = TestScene::from_text(
        document(kInside, 60, 16, diffuse("wall", albedo, 1), sphere("wall", "[0, 0, 0]", 1, true)));
    expect_seen(seen_by(scene, GetParam() + ":photons=4000", 4, bounces), exact, 5e-3);
  }
}

TEST_P(PhotonAnswers, APointLightGivesRadianceOneAtTheCentreOfADiffuseSphere) {
  for (const auto& [radius, rho, intensity] : {std::tuple(1.0, 0.5, M_PI), {2.5, 0.3, 40.0}}) {
    const auto scene = TestScene::from_text(
        document(kInside, 60, 16, diffuse("wall", rho), sphere("wall", "[0, 0, 0]", radius, true),
                 fmt::format(R"({{"point": {{"position": [0, 0, 0], "intensity": {}}}}})", gray(intensity))));
    expect_seen(seen_by(scene, GetParam() + ":photons=4000", 4), intensity / (M_PI * radius * radius) * rho / (1 - rho),
                5e-3);
  }
}

TEST_P(PhotonAnswers, ABlackEmitterLightsADiffuseSphereByTheClosedForm) {
  for (const auto& [r, room, rho] : {std::tuple(0.25, 1.0, 0.5), {0.9, 2.0, 0.8}}) {
    const double f = r * r / (room * room);
    const auto scene =
        TestScene::from_text(document(fmt::format(R"("eye": [{}, 0, 0], "look_at": [{}, 0, 0])", 0.6 * room, room), 60,
                                      16, diffuse("wall", rho) + also(diffuse("lamp", 0, 1)),
                                      sphere("wall", "[0, 0, 0]", room, true) + also(sphere("lamp", "[0, 0, 0]", r))));
    expect_seen(seen_by(scene, GetParam() + ":photons=8000", 4), rho * f / (1 - rho * (1 - f)), 1e-2);
  }
}

// Next-event estimation never samples a constant environment, but samples an image. A ball of reflectance ρ shows ρL.
TEST_P(PhotonAnswers, ABallReflectsItsAlbedoUnderAUniformSky) {
  for (const auto& [rho, sky] : {std::pair(1.0, 0.7), {0.4, 3.0}}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 4], "look_at": [0, 0, 0])", 12, 16, diffuse("ball", rho),
                 sphere("ball", "[0, 0, 0]", 1), fmt::format(R"({{"environment": {{"radiance": {}}}}})", gray(sky))));
    expect_seen(seen_by(scene, GetParam() + ":photons=20000", 4), rho * sky, 1e-2);
  }
}

// A small patch of a white floor. Irradiance varies over it by at most 3e-3.
TEST_P(PhotonAnswers, ASphereLightsAFloor) {
  const double x = 1, height = 2, radius = 0.7, radiance = 3;
  const double distance2 = x * x + height * height;
  const auto scene =
      TestScene::from_text(document(R"("eye": [1, 0.5, 0], "look_at": [1, 0, 0], "up": [1, 0, 0])", 20, 8,
                                    diffuse("floor", 1) + also(diffuse("lamp", 0, radiance)),
                                    mesh("floor", "floor.obj") + also(sphere("lamp", "[0, 2, 0]", radius))),
                           {{"floor.obj", plane(6, 0, true)}});
  expect_seen(seen_by(scene, GetParam() + ":photons=60000", 5, 1),
              radiance * radius * radius / distance2 * height / std::sqrt(distance2), 1e-2, 4e-3);
}

// Meters count photons that cross them, without a radius.
TEST_P(PhotonAnswers, UnitSquaresHaveTheirFormFactors) {
  const auto patch = [](const std::string& edge1, const std::string& edge2) {
    return fmt::format(R"("meters": [{{"name": "m", "patch": {{"corner": [0, 0, 0], "edge1": {}, "edge2": {}}}}}])",
                       edge1, edge2);
  };
  struct Case {
    std::string emitter;
    double factor;
  };
  for (const Case& c : {Case{polygon({{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}), 0.1998249},
                        {polygon({{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}), 0.2000438}}) {
    const auto scene = scene_with(fmt::format(R"("materials": [{}], "objects": [{}], {})", diffuse("lamp", 0, 2),
                                              mesh("lamp", "lamp.obj"), patch("[0, 0, 1]", "[1, 0, 0]")),
                                  {{"lamp.obj", c.emitter}});
    const auto reading = read_meters(scene, 5, 1, nullptr, GetParam() + ":photons=20000").front();
    expect_reading(reading, 2 * M_PI * c.factor, 3e-2);
  }
}

}  // namespace
}  // namespace lightmill::test
