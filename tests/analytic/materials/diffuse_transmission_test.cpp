// Thin diffuse sheets: samples, albedo, and exact answers by all methods.
#include "common/materials/diffuse_transmission.h"

#include "tests/analytic/materials/bsdf_checks.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string sheet(double reflectance, double transmittance) {
  return fmt::format(R"("diffuse": {{"reflectance": {}, "transmittance": {}}})", gray(reflectance),
                     gray(transmittance));
}

/// The same of a principled material without gloss.
std::string principled_sheet(double reflectance, double transmittance) {
  return fmt::format(R"("principled": {{"base_color": {}, "specular": 0, "transmittance": {}}})",
                     gray(reflectance / (1 - transmittance)), gray(transmittance));
}

TEST(DiffuseTransmission, SamplesFollowThePdfAndCarryBothShares) {
  std::uint32_t seed = 8400;
  for (const auto& [reflected, transmitted] : {std::pair(0.5f, 0.25f), {0.0f, 0.7f}, {0.1f, 0.9f}}) {
    const DiffuseTransmission8 bsdf{broadcast(Vec3(reflected)), broadcast(Vec3(transmitted))};
    for (const double degrees : {0.0, 50.0, 88.0}) {
      const Vec3d wo = tilted(degrees);
      const Grid grid(wo, -wo, 0.5);
      EXPECT_LT(sample_z(bsdf, wo, grid, ++seed, 1e-4), kChiSquaredThreshold) << reflected << ' ' << degrees;
      const Albedo a = directional_albedo(bsdf, wo, grid, ++seed);
      EXPECT_NEAR(a.by_quadrature, reflected + transmitted, 1e-3) << reflected << ' ' << degrees;
      EXPECT_NEAR(a.by_sampling, reflected + transmitted, 5 * a.standard_error + 1e-5) << reflected << ' ' << degrees;
    }
  }
}

TEST(DiffuseTransmission, SheetsShowTheSunOnBothSides) {
  // Irradiance 1 along the normal: ρ/π on the lit side, τ/π on the other.
  for (const std::string& kind : {sheet(0.3, 0.6), principled_sheet(0.3, 0.6)}) {
    for (const auto& [height, exact] : {std::pair(1, 0.3 / M_PI), {-1, 0.6 / M_PI}}) {
      const auto scene = TestScene::from_text(
          document(fmt::format(R"("eye": [0, {}, 0], "look_at": [0, 0, 0], "up": [1, 0, 0])", height), 0.01, 8,
                   named("sheet", kind), mesh("sheet", "sheet.obj"),
                   fmt::format(R"({{"directional": {{"direction": [0, -1, 0], "irradiance": {}}}}})", gray(1))),
          {{"sheet.obj", horizontal_rectangle(-5, 5, -5, 5, 0, true)}});
      for (const char* method : {"path", "caustic:photons=500", "vcm:photons=500", "whitted", "raycast"}) {
        expect_answer(mean_of(scene.render({method, 51, 1}, 8), 0), exact, 2e-2);
      }
    }
  }
}

TEST(DiffuseTransmission, LampshadesHaveTheExactRadianceInside) {
  // A closed sphere in radiance 1 has L = ρL + τ inside.
  for (const std::string& kind : {sheet(0.3, 0.5), principled_sheet(0.3, 0.5)}) {
    const auto scene = TestScene::from_text(document(
        R"("eye": [0, 0.2, 0.1], "look_at": [0.3, 0.1, -1])", 60, 32, named("shade", kind) + also(diffuse("sky", 0, 1)),
        sphere("shade", "[0, 0, 0]", 1) + also(sphere("sky", "[0, 0, 0]", 4, true))));
    for (const char* method : {"path", "caustic:photons=5000", "vcm:photons=20000"}) {
      const Estimate seen = mean_of(scene.render({method, 52, 0}, 8), 1);
      EXPECT_LT(seen.standard_error, 1e-2) << method;
      EXPECT_NEAR(seen.value, 0.5 / 0.7, 5 * seen.standard_error + 5e-3) << method;
    }
  }
}

TEST(DiffuseTransmission, LightThatPassesStaysInItsMedium) {
  // A point light above a sheet and the camera below it, all in a ball of absorption a: τ/π · I/d² · exp(−a(d + e)).
  const double a = 0.4, d = 0.5, e = 1;
  const auto scene = TestScene::from_text(
      document(fmt::format(R"("eye": [0, {}, 0], "look_at": [0, 0, 0], "up": [1, 0, 0])", -e), 0.01, 8,
               named("sheet", sheet(0.3, 0.6)) +
                   also(named("fog",
                              fmt::format(R"("dielectric": {{"ior": 1}}, "interior": {{"absorption": {}}})", gray(a)))),
               mesh("sheet", "sheet.obj") + also(sphere("fog", "[0, 0, 0]", 3)),
               fmt::format(R"({{"point": {{"position": [0, {}, 0], "intensity": {}}}}})", d, gray(1))),
      {{"sheet.obj", horizontal_rectangle(-1, 1, -1, 1, 0, true)}});
  for (const char* method : {"path", "caustic:photons=500", "vcm:photons=500", "whitted"}) {
    expect_answer(mean_of(scene.render({method, 53, 1}, 8), 0), 0.6 / M_PI / (d * d) * std::exp(-a * (d + e)), 2e-2);
  }
}

TEST(DiffuseTransmission, TransmittanceIsLoweredWhereBothSharesExceedOne) {
  const auto scene = TestScene::from_text(document(
      R"("eye": [0, 0, 4], "look_at": [0, 0, 0])", 40, 16, named("sheet", sheet(0.4, 0.9)) + also(diffuse("sky", 0, 1)),
      sphere("sheet", "[0, 0, 0]", 1) + also(sphere("sky", "[0, 0, 0]", 9, true))));
  const Estimate seen = mean_of(scene.render({"path", 54, 0}, 8), 1);
  EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 1e-4);
}

TEST(DiffuseTransmission, RoughSheetsAreRefused) {
  EXPECT_NE(
      refusal(
          document(
              R"("eye": [0, 1, 0], "look_at": [0, 0, 0], "up": [1, 0, 0])", 1, 8,
              named(
                  "s",
                  R"("diffuse": {"reflectance": {"rgb": [0, 0, 0]}, "roughness": 0.5, "transmittance": {"rgb": [1, 1, 1]}})"),
              sphere("s", "[0, 0, 0]", 1)))
          .find("materials[0].diffuse.roughness: must be 0 with a transmittance"),
      std::string::npos);
}

}  // namespace
}  // namespace lightmill::test
