// Lambert, the mirror and smooth glass, with 100,000 draws each. The threshold raises a false alarm once in 3.5 million
// tests. Values without randomness are compared up to rounding.
#include "common/materials/dielectric.h"
#include "common/materials/diffuse.h"
#include "common/materials/mirror.h"
#include "tests/analytic/materials/bsdf_checks.h"
#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {
namespace {

const double kSmoothAngles[] = {0.01, 20, 50, 75, 88};
const double kSmoothEtas[] = {1.5, 1 / 1.5, 1.1, 2.4, 1 / 2.4};

const F8 kLast(0x1.fffffep-1f);  ///< the largest random number

Vec3d direction_of(const BsdfSample8& s) {
  return {Lanes(s.wi.x)[0], Lanes(s.wi.y)[0], Lanes(s.wi.z)[0]};
}
void expect_direction(const BsdfSample8& s, const Vec3d& exact) {
  EXPECT_LT(glm::length(direction_of(s) - exact), 2e-6);
}

Diffuse8 lambert(double albedo) {
  return {broadcast(Vec3(static_cast<float>(albedo)))};
}

TEST(Diffuse, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 1400;
  for (const double degrees : kSmoothAngles) {
    const Vec3d wo = tilted(degrees);
    EXPECT_LT(sample_z(lambert(0.8), wo, Grid(tilted(0), -wo, 0.5), ++seed, 1e-4), kChiSquaredThreshold) << degrees;
  }
}

TEST(Diffuse, ReflectsItsAlbedoWhateverTheAngle) {
  std::uint32_t seed = 1500;
  for (const double albedo : {0.0, 0.3, 1.0}) {
    for (const double degrees : kSmoothAngles) {
      const Vec3d wo = tilted(degrees);
      const Albedo a = directional_albedo(lambert(albedo), wo, Grid(tilted(0), -wo, 0.5), ++seed);
      EXPECT_NEAR(a.by_quadrature, albedo, 1e-3 * albedo) << degrees;
      EXPECT_NEAR(a.by_sampling, albedo, 1e-6) << degrees;  // every sample has the same weight
    }
  }
}

TEST(Diffuse, IsReciprocal) {
  expect_reciprocity([](const V8&, M8) { return lambert(0.7); }, 1, false, 1e-6);
}

TEST(Mirror, ReflectsTheSameShareInBothDirections) {
  const Mirror8 mirror{broadcast(Vec3(0.9f, 0.5f, 1.0f))};
  for (const double degrees : kSmoothAngles) {
    const Vec3d wo = tilted(degrees);
    const BsdfSample8 there = mirror.sample(to_lanes(wo)), back = mirror.sample(there.wi);
    expect_direction(there, mirrored(wo));
    expect_direction(back, wo);  // reciprocity of a delta: the same way back, with the same share
    for (const BsdfSample8& s : {there, back}) {
      EXPECT_EQ(Lanes(s.weight.x)[0], 0.9f);
      EXPECT_EQ(Lanes(s.weight.y)[0], 0.5f);
      EXPECT_EQ(Lanes(s.weight.z)[0], 1.0f);
      EXPECT_EQ(Lanes(s.pdf_solid_angle)[0], 0);
      EXPECT_EQ(s.transmitted.bits(), 0);
    }
  }
}

TEST(SmoothDielectric, ReflectsAsOftenAsFresnelSays) {
  std::uint32_t seed = 1600;
  for (const double eta : kSmoothEtas) {
    for (const double degrees : {0.0, 30.0, 45.0, 75.0, 85.0}) {
      const Vec3d wo = tilted(degrees);
      double reflected = 0;
      ++seed;
      for (int i = 0; i < kDraws; i += 8) {
        const F8 u = hashed_number(U8(static_cast<std::uint32_t>(i)) + U8::lane_index(), U8(mix(seed)));
        reflected += 8 - Dielectric8{F8(static_cast<float>(eta))}.sample(to_lanes(wo), u).transmitted.count();
      }
      const double f = fresnel_formula(wo.z, eta);
      if (f >= 1) {
        EXPECT_EQ(reflected, kDraws) << eta << ' ' << degrees;
        continue;
      }
      // The count is binomial, with one degree of freedom. Its root is normal.
      EXPECT_LT(std::abs(reflected - kDraws * f), kChiSquaredThreshold * std::sqrt(kDraws * f * (1 - f)))
          << eta << ' ' << degrees;
    }
  }
}

TEST(SmoothDielectric, IsReciprocalUpToEtaSquaredAndKeepsAllEnergy) {
  for (const double eta : kSmoothEtas) {
    for (const double degrees : kSmoothAngles) {
      const Vec3d wo = tilted(degrees);
      const Dielectric8 front{F8(static_cast<float>(eta))}, back{F8(static_cast<float>(1 / eta))};
      // Reflected light keeps its radiance, and refracted radiance is η² denser or thinner. Fresnel's shares sum to 1,
      // so nothing is lost.
      const BsdfSample8 reflected = front.sample(to_lanes(wo), F8(0.0f));
      EXPECT_EQ(Lanes(reflected.weight.x)[0], 1);
      expect_direction(reflected, mirrored(wo));
      const BsdfSample8 refracted = front.sample(to_lanes(wo), kLast);
      if (refracted.transmitted.none()) {
        EXPECT_GE(std::sin(degrees * M_PI / 180), eta);  // total reflection
        continue;
      }
      EXPECT_NEAR(Lanes(refracted.weight.x)[0] * eta * eta, 1, 1e-6);
      EXPECT_NEAR(Lanes(refracted.eta)[0], eta, 1e-6);
      const Vec3d wi = direction_of(refracted);
      EXPECT_NEAR(eta * std::hypot(wi.x, wi.y), std::hypot(wo.x, wo.y), 1e-6);  // Snell
      // From there the way back is the same, with the same share. The radiance thins as much as it became denser.
      const Vec3d from{wi.x, wi.y, -wi.z};
      const BsdfSample8 returned = back.sample(to_lanes(from), kLast);
      EXPECT_LT(glm::length(direction_of(returned) - Vec3d(wo.x, wo.y, -wo.z)), 1e-5 / wo.z);
      EXPECT_NEAR(Lanes(refracted.weight.x)[0] * Lanes(returned.weight.x)[0], 1, 1e-6);
      EXPECT_NEAR(fresnel_formula(from.z, 1 / eta), fresnel_formula(wo.z, eta), 1e-4) << eta << ' ' << degrees;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
