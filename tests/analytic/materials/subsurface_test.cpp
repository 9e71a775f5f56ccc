// Subsurface scattering: sheets around media, against exact answers.
#include "common/scene/document/subsurface.h"

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string skin(const std::string& interior, double reflectance = 0, double transmittance = 1) {
  return named("skin", fmt::format(R"("diffuse": {{"reflectance": {}, "transmittance": {}}}, "interior": {{{}}})",
                                   gray(reflectance), gray(transmittance), interior));
}

/// A principled body of this colour. `layers`: further fields.
std::string glossy_skin(const std::string& interior, const std::string& layers, double base = 0.5) {
  return named("skin", fmt::format(R"("principled": {{"base_color": {}, "transmittance": {}{}}}, "interior": {{{}}})",
                                   gray(base), gray(1), layers.empty() ? "" : ", " + layers, interior));
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

TEST(Subsurface, WhiteMediaWithAHighlightPassTheWhiteFurnaceTest) {
  std::uint32_t seed = 760;
  for (const double roughness : {0.0, 0.2, 0.5, 1.0}) {
    for (const char* layers : {R"("specular": 0.5)", R"("specular": 1, "ior": 1.8)",
                               R"("coat": 1, "coat_roughness": 0.2)", R"("sheen_color": {"rgb": [0.6, 0.6, 0.6]})"}) {
      const std::string fields = fmt::format(R"("roughness": {}, {})", roughness, layers);
      const Estimate seen = ball_in_sky(glossy_skin(R"("scattering": {"rgb": [4, 4, 4]})", fields), 30, ++seed, 5);
      EXPECT_LT(seen.standard_error, 1e-2) << fields;
      // The tables of the layers' albedos.
      EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 0.01) << fields;
    }
  }
}

TEST(Subsurface, BodiesOfShortRadiusLookLikeDiffusePaintBelowTheSameLayers) {
  std::uint32_t seed = 780;
  for (const char* layers :
       {R"("roughness": 0.3)", R"("roughness": 0, "specular": 1, "ior": 2)",
        R"("roughness": 0.6, "coat": 0.8, "coat_roughness": 0.1)", R"("sheen_color": {"rgb": [0.4, 0.4, 0.4]})"}) {
    for (const double color : {0.3, 0.8}) {
      const std::string interior =
          fmt::format(R"("subsurface": {{"color": {}, "radius": {}}})", gray(color), gray(0.001));
      const Estimate body = ball_in_sky(glossy_skin(interior, layers), 20, ++seed, 6);
      const Estimate paint = ball_in_sky(
          named("skin", fmt::format(R"("principled": {{"base_color": {}, {}}})", gray(color), layers)), 20, ++seed, 6);
      EXPECT_LT(body.standard_error, 5e-3) << layers;
      // A radius of 0.001 in a ball of radius 1, and the tables of the layers' albedos.
      EXPECT_NEAR(body.value, paint.value, 5 * (body.standard_error + paint.standard_error) + 5e-3) << layers << color;
    }
  }
}

TEST(Subsurface, AllMethodsAgreeOnAbsorbingBodiesWithAHighlight) {
  // Light enters and leaves, so methods that trace light find the same only if the surface is reciprocal.
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 16,
               glossy_skin(R"("absorption": {"rgb": [0.5, 0.5, 0.5]})",
                           R"("roughness": 0.5, "specular": 1, "ior": 2, "coat": 0.5, "coat_roughness": 0.4)") +
                   also(diffuse("lamp", 0, 20)),
               sphere("skin", "[0, 0, 0]", 1) + also(sphere("lamp", "[1.5, 1.5, 1]", 0.3))));
  const Estimate path = mean_of(scene.render({"path", 790, 0}, 8), 1);
  EXPECT_LT(path.standard_error, 1e-2 * path.value);
  for (const char* method : {"caustic:photons=20000", "vcm:photons=20000"}) {
    const Estimate other = mean_of(scene.render({method, 791, 0}, 8), 1);
    EXPECT_NEAR(other.value, path.value, 5 * (other.standard_error + path.standard_error) + 1e-2 * path.value)
        << method;
  }
}

TEST(Subsurface, AbsorbingBallsShowTheLightOfTheirChords) {
  // A chord that enters with a cosine lobe has the length l = 2 cos: the mean of exp(−σl) is 2∫exp(−2σc) c dc. Light
  // leaves at once, because nothing is scattered.
  const double sigma = 0.7, s = 2 * sigma;
  const double exact = 2 * (1 - std::exp(-s) * (1 + s)) / (s * s);
  const std::string interior = fmt::format(R"("absorption": {})", gray(sigma));
  expect_answer(ball_in_sky(skin(interior), 10, 720, 6), exact, 1e-2);
  expect_answer(ball_in_sky(glossy_skin(interior, R"("specular": 0)"), 10, 721, 6), exact, 1e-2);
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

TEST(Subsurface, MixturesWithPrincipledSheetsHaveAnInside) {
  const std::string material = named("skin",
                                     R"("mixture": {"first": {"diffuse": {"reflectance": {"rgb": [1, 1, 1]}}},
         "second": {"principled": {"roughness": 0.4, "transmittance": {"rgb": [1, 1, 1]}}}, "factor": 0.6},
         "interior": {"scattering": {"rgb": [3, 3, 3]}})");
  const Estimate seen = ball_in_sky(material, 30, 741, 7);
  EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 0.01);
}

TEST(Subsurface, VcmRefusesIt) {
  const std::string scattering = R"("scattering": {"rgb": [4, 4, 4]})";
  for (const std::string& material : {skin(scattering), glossy_skin(scattering, "")}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 16, material, sphere("skin", "[0, 0, 0]", 1)));
    const auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
    ASSERT_TRUE(compiled.ok()) << message_of(compiled.status());
    const auto made = make_method(*compiled, {"vcm", 1, 0});
    ASSERT_FALSE(made.ok());
    EXPECT_NE(message_of(made.status()).find("does not support scattering media, but path and caustic do"),
              std::string::npos);
  }
}

// Photons go through the sheet, walk in the medium, and are gathered where the camera sees the sheet.
TEST(Subsurface, PpmMatchesPath) {
  const std::string scattering = R"("scattering": {"rgb": [6, 3, 9]}, "absorption": {"rgb": [0.5, 2, 0]})";
  for (const std::string& material : {skin(scattering), glossy_skin(scattering, "")}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 16, material, sphere("skin", "[0, 0, 0]", 1),
                 R"({"point": {"position": [2, 3, 2], "intensity": {"rgb": [9, 9, 9]}}})"));
    const HalfImages path = scene.render({"path", 71, 0}, 8), ppm = scene.render({"ppm:photons=20000", 72, 0}, 6);
    for (int channel = 0; channel < 3; ++channel) {
      const Estimate a = mean_of(path, channel), b = mean_of(ppm, channel);
      const double error = std::hypot(a.standard_error, b.standard_error);
      EXPECT_LT(error, 2e-2 * a.value);
      EXPECT_NEAR(a.value, b.value, 5 * error + 1e-2 * a.value) << channel;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
