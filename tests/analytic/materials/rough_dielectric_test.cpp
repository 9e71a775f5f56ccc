// Rough glass, with 100,000 draws each. The threshold raises a false alarm once in 3.5 million tests.
#include "common/materials/rough_dielectric.h"
#include "tests/analytic/materials/bsdf_checks.h"

namespace lightmill::test {
namespace {

RoughDielectric8 glass(double eta, double alpha) {
  return {F8(static_cast<float>(eta)), F8(static_cast<float>(alpha))};
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
        EXPECT_LT(sample_z(glass(eta, alpha), wo, grid, ++seed, 2e-2), kChiSquaredThreshold)
            << eta << " " << alpha << " " << degrees;
      }
    }
  }
}

TEST(RoughDielectric, MakesNoEnergy) {
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

TEST(RoughDielectric, IsReciprocalUpToEtaSquared) {
  for (const double alpha : {0.1, 0.4, 1.0}) {
    for (const double eta : {1.5, 0.8}) {
      expect_reciprocity(
          [&](const V8&, M8 front) {
            return RoughDielectric8{select(front, F8(static_cast<float>(eta)), F8(static_cast<float>(1 / eta))),
                                    F8(static_cast<float>(alpha))};
          },
          eta, true, 5e-3);
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
