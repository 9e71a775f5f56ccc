// Rough glass, with 100,000 draws each. The threshold raises a false alarm once in 3.5 million tests.
#include "common/materials/rough_dielectric.h"
#include "tests/analytic/materials/bsdf_checks.h"
#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {
namespace {

RoughDielectric8 glass(double eta, double alpha) {
  return {F8(static_cast<float>(eta)), F8(static_cast<float>(alpha))};
}

/// With the light of several bounces.
RoughDielectric8 compensated(RoughDielectric8 bsdf) {
  bsdf.compensated = M8(true);
  return bsdf;
}

/// A refracted lobe is narrower when light bends less. With facets in all directions it lies about straight ahead.
Grid grid_for(const Vec3d& wo, double eta, double alpha) {
  const double width = std::min(2 * alpha, 0.3);
  return {mirrored(wo), alpha < 0.5 ? refracted(wo, eta) : -wo, width, width * std::min(1.0, std::abs(1 - 1 / eta))};
}

const double kEtas[] = {1.5, 1 / 1.5, 1.1, 2.4};

TEST(RoughDielectric, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 500;
  for (const double eta : kEtas) {
    for (const double alpha : {1e-3, 0.05, 0.3, 1.0}) {
      for (const double degrees : {0.01, 30.0, 60.0, 88.0}) {
        const Vec3d wo = tilted(degrees);
        const Grid grid = grid_for(wo, eta, alpha);
        EXPECT_LT(sample_z(compensated(glass(eta, alpha)), wo, grid, ++seed, 2e-2), kChiSquaredThreshold)
            << eta << " " << alpha << " " << degrees;
      }
    }
  }
}

TEST(RoughDielectric, ConservesEnergy) {
  std::uint32_t seed = 600;
  for (const double eta : kEtas) {
    for (const double alpha : {1e-3, 0.05, 0.3, 1.0}) {
      for (const double degrees : {0.01, 30.0, 60.0, 88.0}) {
        const Vec3d wo = tilted(degrees);
        const Grid grid = grid_for(wo, eta, alpha);
        const Albedo a = directional_albedo(glass(eta, alpha), wo, grid, ++seed, eta);
        EXPECT_NEAR(a.by_sampling, a.by_quadrature, 5 * a.standard_error + 5e-3)
            << eta << " " << alpha << " " << degrees;
        EXPECT_LE(a.by_sampling, 1.0001) << eta << " " << alpha << " " << degrees;
        if (alpha == 1e-3 && degrees < 80) {
          EXPECT_GT(a.by_sampling, 0.999) << eta << " " << degrees;
        }
      }
    }
  }
}

TEST(RoughDielectric, CompensatedGlassReflectsAndTransmitsAll) {
  for (const double eta : {1.33, 1 / 1.33, 1.5, 1 / 1.5, 1.77, 1 / 1.77, 2.4, 1 / 2.4}) {
    for (const double roughness : {0.01, 0.1, 0.25, 0.4, 0.6, 0.8, 1.0}) {
      for (const double degrees : {0.01, 30.0, 45.0, 60.0, 75.0, 89.0}) {
        const Vec3d wo = tilted(degrees);
        // Rough glass from within has unequal weights, and so some noise.
        const double noise = eta < 1 && roughness > 0.7 ? 0.02 : 0.002;
        EXPECT_NEAR(even_albedo(compensated(glass(eta, roughness * roughness)), wo, eta), 1, 0.01 + noise)
            << eta << " " << roughness << " " << degrees;
      }
    }
  }
}

// Near index 1 the compensation fades. It must not make light.
TEST(RoughDielectric, CompensatedGlassOfAnyIndexConservesEnergy) {
  for (const double eta : {1.003, 1 / 1.003, 1.02, 1 / 1.02, 1.05, 1 / 1.05, 1.12, 1 / 1.12, 4.0, 0.25, 10.0, 0.1}) {
    for (const double roughness : {0.2, 0.5, 0.8, 1.0}) {
      for (const double degrees : {0.01, 45.0, 75.0, 89.0}) {
        const Vec3d wo = tilted(degrees);
        EXPECT_LT(even_albedo(compensated(glass(eta, roughness * roughness)), wo, eta), 1.03)
            << eta << " " << roughness << " " << degrees;
      }
    }
  }
}

TEST(RoughDielectric, SingleScatteringHasTheAlbedoOfThePublishedFormulas) {
  for (const double eta : {1.33, 2.4}) {
    for (const double alpha : {0.2, 0.5, 1.0}) {
      for (const double degrees : {0.01, 40.0, 70.0}) {
        const Vec3d wo = tilted(degrees), seen(wo.x, wo.z, 0);
        const Albedo a = directional_albedo(glass(eta, alpha), wo, grid_for(wo, eta, alpha), 4, eta);
        const double reflected =
            integral_over_hemisphere([&](const Vec3d& wi) { return conductor_formula(eta, 0, alpha, seen, wi); });
        const double refracted = integral_over_hemisphere(
            [&](const Vec3d& wi) {
              // Only the front of a facet is seen, and it refracts to its other side.
              const Vec3d sum = seen + wi * eta, m = sum.y < 0 ? -sum : sum;
              return glm::dot(seen, m) > 0 && glm::dot(wi, m) < 0 ? refraction_formula(eta, alpha, seen, wi) : 0.0;
            },
            true);
        EXPECT_NEAR(a.by_sampling, reflected + eta * eta * refracted, 5 * a.standard_error + 2e-3)
            << eta << " " << alpha << " " << degrees;
      }
    }
  }
}

TEST(RoughDielectric, IsReciprocalUpToEtaSquared) {
  for (const M8 all_bounces : {M8(false), M8(true)}) {
    for (const double alpha : {0.1, 0.4, 1.0}) {
      for (const double eta : {1.5, 0.8}) {
        expect_reciprocity(
            [&](const V8&, M8 front) {
              return RoughDielectric8{
                  .eta = select(front, F8(static_cast<float>(eta)), F8(static_cast<float>(1 / eta))),
                  .alpha = F8(static_cast<float>(alpha)),
                  .compensated = all_bounces};
            },
            eta, true, 5e-3);
      }
    }
  }
}

TEST(RoughDielectric, EqualsTheSmoothDielectricAtRoughnessZero) {
  const V8 wo = to_lanes(tilted(50));
  for (const double u : {0.01, 0.5}) {
    const F8 choice(static_cast<float>(u));
    const BsdfSample8 a = glass(1.5, 0).sample(wo, {F8(0.2f), F8(0.9f)}, choice);
    const BsdfSample8 b = Dielectric8{F8(1.5f)}.sample(wo, choice);
    EXPECT_NEAR(Lanes(a.wi.x)[0], Lanes(b.wi.x)[0], 1e-6);
    EXPECT_NEAR(Lanes(a.wi.z)[0], Lanes(b.wi.z)[0], 1e-6);
    EXPECT_NEAR(Lanes(a.weight.x)[0], Lanes(b.weight.x)[0], 1e-6);
    EXPECT_EQ(Lanes(a.pdf_solid_angle)[0], 0);
    EXPECT_EQ(Lanes(a.eta)[0], Lanes(b.eta)[0]);
  }
}

TEST(RoughDielectric, WithIndexOneLightGoesStraightOn) {
  for (const double alpha : {0.0, 0.01, 0.5, 1.0}) {
    const Vec3d from = tilted(70);
    const BsdfSample8 s = glass(1, alpha).sample(to_lanes(from), {F8(0.4f), F8(0.3f)}, F8(1e-6f));
    EXPECT_EQ(s.transmitted.bits(), 255);
    EXPECT_NEAR(Lanes(s.wi.x)[0], -from.x, 1e-6);
    EXPECT_NEAR(Lanes(s.wi.z)[0], -from.z, 1e-6);
    EXPECT_NEAR(Lanes(s.weight.x)[0], 1, 1e-6);
    EXPECT_EQ(Lanes(s.pdf_solid_angle)[0], 0);
    EXPECT_EQ(Lanes(glass(1, alpha).eval(to_lanes(from), to_lanes(-from)).x)[0], 0);
  }
}

}  // namespace
}  // namespace lightmill::test
