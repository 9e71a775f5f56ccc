// Subsurface scattering: sheets around media, against exact answers.
#include "common/scene/document/subsurface.h"

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string skin(const std::string& interior, double reflectance = 0, double transmittance = 1) {
  return named("skin", fmt::format(R"("diffuse": {{"reflectance": {}, "transmittance": {}}}, "interior": {{{}}})",
                                   gray(reflectance), gray(transmittance), interior));
}

/// A ball of radius 1 in a sky of radiance 1, seen from a distance of 3.
Estimate ball_in_sky(const std::string& material, double fov, std::uint32_t seed, int log2_samples) {
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", fov, 16, material + also(diffuse("sky", 0, 1)),
               sphere("sky", "[0, 0, 0]", 10, true) + also(sphere("skin", "[0, 0, 0]", 1))));
  return mean_of(scene.render({"path", seed, 0}, log2_samples), 1);
}

TEST(Subsurface, WhiteMediaPassTheWhiteFurnaceTest) {
  std::uint32_t seed = 710;
  for (const auto& [reflectance, transmittance, g] : {std::tuple(0.0, 1.0, 0.0), {0.3, 0.7, 0.0}, {0.0, 1.0, 0.7}}) {
    const std::string interior = fmt::format(R"("scattering": {{"rgb": [4, 4, 4]}}, "anisotropy": {})", g);
    expect_answer(ball_in_sky(skin(interior, reflectance, transmittance), 30, ++seed, 7), 1, 1e-2);
  }
}

TEST(Subsurface, AbsorbingBallsShowTheLightOfTheirChords) {
  // A chord that enters with a cosine lobe has the length l = 2 cos: the mean of exp(−σl) is 2∫exp(−2σc) c dc. Light
  // leaves at once, because nothing is scattered.
  const double sigma = 0.7, s = 2 * sigma;
  const double exact = 2 * (1 - std::exp(-s) * (1 + s)) / (s * s);
  const std::string interior = fmt::format(R"("absorption": {})", gray(sigma));
  expect_answer(ball_in_sky(skin(interior), 10, 720, 6), exact, 1e-2);
}

/// Share of diffuse light that a half-space of isotropic scattering returns: 1 − 2√(1 − α) ∫H(μ) μ dμ, with the function
/// H of Chandrasekhar (Radiative Transfer, 1960), which is found by iteration.
double returned_share(double alpha) {
  constexpr int kSteps = 400;
  const double root = std::sqrt(1 - alpha);
  const auto mu = [](int i) { return (i + 0.5) / kSteps; };
  std::vector<double> h(kSteps, 1.0);
  for (double change = 1; change > 1e-9;) {
    std::vector<double> next(kSteps);
    change = 0;
    for (int i = 0; i < kSteps; ++i) {
      double sum = 0;
      for (int j = 0; j < kSteps; ++j) {
        sum += mu(j) * h[static_cast<std::size_t>(j)] / (mu(i) + mu(j));
      }
      const auto at = static_cast<std::size_t>(i);
      next[at] = 1 / (root + alpha / 2 * sum / kSteps);
      change = std::max(change, std::abs(next[at] - h[at]));
    }
    h = next;
  }
  double moment = 0;
  for (int i = 0; i < kSteps; ++i) {
    moment += mu(i) * h[static_cast<std::size_t>(i)] / kSteps;
  }
  return 1 - 2 * root * moment;
}

TEST(Subsurface, ThickBodiesReturnTheColourThatWasAskedFor) {
  for (const double color : {0.02, 0.1, 0.3, 0.5, 0.8, 0.95}) {
    EXPECT_NEAR(returned_share(scattering_albedo(color, 0)), color, 2.5e-3) << color;
  }
  EXPECT_NEAR(scattering_albedo(0, 0.5), 0, 1e-4);
  EXPECT_NEAR(scattering_albedo(1, 0.5), 1, 1e-4);
}

/// A ball of radius 1 whose medium has the radius 0.001. Curvature then adds about 0.001 to the share.
Estimate small_radius(double color, double g, std::uint32_t seed) {
  const std::string interior =
      fmt::format(R"("subsurface": {{"color": {}, "radius": {}}}, "anisotropy": {})", gray(color), gray(0.001), g);
  return ball_in_sky(skin(interior), 10, seed, 6);
}

TEST(Subsurface, BallsOfShortRadiusShowTheirColour) {
  std::uint32_t seed = 730;
  for (const double color : {0.2, 0.5, 0.8}) {
    expect_answer(small_radius(color, 0, ++seed), color, 2e-2);
  }
}

TEST(Subsurface, ForwardScatteringShowsNearlyTheColour) {
  // Media with the same extinction · (1 − g) look alike after many scatterings, and only nearly after few.
  std::uint32_t seed = 740;
  for (const double color : {0.2, 0.5, 0.8}) {
    const Estimate shown = small_radius(color, 0.5, ++seed);
    EXPECT_LT(shown.standard_error, 0.005);
    EXPECT_NEAR(shown.value, color, 0.02 + 5 * shown.standard_error) << color;
  }
}

TEST(Subsurface, MixturesWithSheetsHaveAnInside) {
  // A white sheet and white matt paint around a white medium hide in uniform light.
  const std::string material = named("skin",
                                     R"("mixture": {"first": {"diffuse": {"reflectance": {"rgb": [1, 1, 1]}}},
         "second": {"diffuse": {"reflectance": {"rgb": [0, 0, 0]}, "transmittance": {"rgb": [1, 1, 1]}}}, "factor": 0.6},
         "interior": {"scattering": {"rgb": [3, 3, 3]}})");
  expect_answer(ball_in_sky(material, 30, 750, 7), 1, 1e-2);
}

TEST(Subsurface, PhotonMethodsRefuseIt) {
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 16,
                                    skin(R"("scattering": {"rgb": [4, 4, 4]})"), sphere("skin", "[0, 0, 0]", 1)));
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  ASSERT_TRUE(compiled.ok()) << message_of(compiled.status());
  for (const char* method : {"caustic", "vcm", "ppm"}) {
    const auto made = make_method(*compiled, {method, 1, 0});
    ASSERT_FALSE(made.ok()) << method;
    EXPECT_NE(message_of(made.status()).find("does not support scattering media, but path does"), std::string::npos);
  }
}

}  // namespace
}  // namespace lightmill::test
