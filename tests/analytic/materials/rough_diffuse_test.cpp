// Rough diffuse surfaces, against the published formula in double precision with the exact integral of its albedo. The
// threshold of chi-squared tests raises a false alarm once in 3.5 million tests.
#include "common/materials/rough_diffuse.h"

#include "common/materials/diffuse.h"
#include "tests/analytic/materials/bsdf_checks.h"
#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {
namespace {

constexpr double kDiffuseAngles[] = {0, 20, 50, 75, 88};
constexpr double kDiffuseRoughnesses[] = {0.1, 0.5, 1};

RoughDiffuse8 rough(double albedo, double roughness, bool compensated = true) {
  return {broadcast(Vec3(static_cast<float>(albedo))), F8(static_cast<float>(roughness)), M8(compensated)};
}
Grid grid_of(const Vec3d& wo) {
  return {wo, -wo, 0.5};
}

TEST(RoughDiffuse, EvaluatesThePublishedFormula) {
  for (const double albedo : {0.2, 0.8, 1.0}) {
    for (const double roughness : kDiffuseRoughnesses) {
      for (int i = 0; i < 500; ++i) {
        const double z = ((i % 31) + 0.5) / 31, r = std::sqrt(1 - z * z), phi = i * 2.399963;
        const Vec3d wo = tilted(89.0 * (i % 23) / 23), wi(r * std::cos(phi), r * std::sin(phi), z);
        const auto eval = [&](bool compensated) {
          return Lanes(rough(albedo, roughness, compensated).eval(to_lanes(wo), to_lanes(wi)).x)[0];
        };
        const double once = fujii_formula(albedo, roughness, upright(wo), upright(wi));
        ASSERT_NEAR(eval(false), once, 1e-5 * once + 1e-7) << albedo << ' ' << roughness << ' ' << i;
        const double all = eon_formula(albedo, roughness, upright(wo), upright(wi));
        ASSERT_NEAR(eval(true), all, 5e-4 * albedo * z) << albedo << ' ' << roughness << ' ' << i;
      }
    }
  }
}

TEST(RoughDiffuse, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 8000;
  for (const double roughness : kDiffuseRoughnesses) {
    for (const double degrees : kDiffuseAngles) {
      const Vec3d wo = tilted(degrees);
      EXPECT_LT(sample_z(rough(0.8, roughness), wo, grid_of(wo), ++seed, 1e-4), kChiSquaredThreshold)
          << roughness << ' ' << degrees;
    }
  }
}

TEST(RoughDiffuse, ReflectsAllLightIfItIsWhite) {
  std::uint32_t seed = 8100;
  for (const double roughness : kDiffuseRoughnesses) {
    for (const double degrees : kDiffuseAngles) {
      const Vec3d wo = tilted(degrees);
      const Albedo a = directional_albedo(rough(1, roughness), wo, grid_of(wo), ++seed);
      EXPECT_NEAR(a.by_quadrature, 1, 2e-3) << roughness << ' ' << degrees;
      EXPECT_NEAR(a.by_sampling, a.by_quadrature, 5 * a.standard_error + 1e-4) << roughness << ' ' << degrees;
      EXPECT_LT(a.standard_error * std::sqrt(kDraws), 0.7) << "standard deviation of the weights";
    }
  }
}

TEST(RoughDiffuse, LosesThePublishedShareWithoutMultipleScattering) {
  std::uint32_t seed = 8200;
  for (const double roughness : kDiffuseRoughnesses) {
    for (const double degrees : kDiffuseAngles) {
      const Vec3d wo = tilted(degrees);
      const Albedo a = directional_albedo(rough(0.6, roughness, false), wo, grid_of(wo), ++seed);
      const double exact = 0.6 * fujii_albedo(roughness, wo.z);
      EXPECT_NEAR(a.by_quadrature, exact, 1e-3 * exact) << roughness << ' ' << degrees;
      EXPECT_NEAR(a.by_sampling, exact, 5 * a.standard_error + 1e-3 * exact) << roughness << ' ' << degrees;
    }
  }
}

TEST(RoughDiffuse, WeightsOfGrazingDirectionsAreBounded) {
  for (const double degrees : {88.0, 89.9}) {
    double largest = 0;
    for_each_sample(rough(1, 1), to_lanes(tilted(degrees)), 8300, [&](const BsdfSample8& s) {
      for (int i = 0; i < 8; ++i) {
        largest = std::max(largest, Lanes(s.weight.x)[i]);
      }
    });
    EXPECT_LT(largest, 3.2) << degrees;
  }
}

TEST(RoughDiffuse, TheMeanAlbedoIsThatOfUniformLight) {
  for (const bool compensated : {false, true}) {
    for (const double albedo : {0.3, 0.8, 1.0}) {
      for (const double roughness : kDiffuseRoughnesses) {
        double sum = 0;
        for (int i = 0; i < 200; ++i) {  // uniform in cos², so weighted by the cosine
          const double cosine = std::sqrt((i + 0.5) / 200);
          const double once = fujii_albedo(roughness, cosine),
                       mean = fujii_scale(roughness) * (1 + (2.0 / 3 - 28 / (15 * M_PI)) * roughness);
          sum += albedo * once + (compensated ? albedo * albedo * mean / (1 - albedo * (1 - mean)) * (1 - once) : 0);
        }
        EXPECT_NEAR(Lanes(rough(albedo, roughness, compensated).mean_albedo().x)[0], sum / 200, 3e-4);
      }
    }
  }
}

TEST(RoughDiffuse, IsReciprocal) {
  for (const bool compensated : {false, true}) {
    expect_reciprocity([&](const V8&, M8) { return rough(0.7, 0.8, compensated); }, 1, false, 1e-5);
  }
}

TEST(RoughDiffuse, IsLambertsWithoutRoughness) {
  const RoughDiffuse8 bsdf = rough(0.6, 0);
  const Diffuse8 lambert{broadcast(Vec3(0.6f))};
  for (int i = 0; i < 100; ++i) {
    const V8 wo = to_lanes(tilted(89.0 * i / 100)), wi = to_lanes(tilted(-85.0 + 1.7 * i));
    EXPECT_FLOAT_EQ(Lanes(bsdf.eval(wo, wi).x)[0], Lanes(lambert.eval(wo, wi).x)[0]);
    EXPECT_FLOAT_EQ(Lanes(bsdf.pdf_solid_angle(wo, wi))[0], Lanes(lambert.pdf_solid_angle(wo, wi))[0]);
  }
}

TEST(RoughDiffuse, ReflectsNothingBelowTheSurface) {
  const RoughDiffuse8 bsdf = rough(0.9, 1);
  const V8 wo = to_lanes(tilted(40)), wi = to_lanes(Vec3d(0.6, 0, -0.8));
  EXPECT_EQ(Lanes(bsdf.eval(wo, wi).x)[0], 0);
  EXPECT_EQ(Lanes(bsdf.pdf_solid_angle(wo, wi))[0], 0);
}

}  // namespace
}  // namespace lightmill::test
