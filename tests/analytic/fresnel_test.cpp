// Fresnel's equations at exactly known points (unpolarised light, n = 1.5).
#include <gtest/gtest.h>

#include <cmath>

#include "common/materials/dielectric.h"

namespace lightmill {
namespace {

double reflectance(double cos_i, double eta) {
  alignas(32) float r[8];
  dielectric::fresnel(F8(static_cast<float>(cos_i)), F8(static_cast<float>(eta))).reflectance.store(r);
  return r[0];
}
double at_degrees(double degrees) {
  return reflectance(std::cos(degrees * M_PI / 180), 1.5);
}

TEST(Fresnel, MatchesKnownValuesFromOutside) {
  EXPECT_NEAR(at_degrees(0), 0.04, 1e-6);
  EXPECT_NEAR(at_degrees(45), 0.0502399, 1e-6);
  EXPECT_NEAR(at_degrees(60), 0.0891867, 1e-6);
  EXPECT_NEAR(at_degrees(75), 0.2530606, 1e-6);
  EXPECT_NEAR(at_degrees(85), 0.6127996, 2e-6);
}

TEST(Fresnel, AllIsReflectedBeyondTheCriticalAngle) {
  const double critical = 41.810315 * M_PI / 180;
  EXPECT_LT(reflectance(std::cos(critical - 1e-3), 1 / 1.5), 1.0);
  EXPECT_EQ(reflectance(std::cos(critical + 1e-3), 1 / 1.5), 1.0);
}

TEST(Fresnel, AtBrewstersAngleReflectionIsHalfThatOfSPolarisation) {
  // There the p term is zero. r_s = (n² − 1)/(n² + 1) in amplitude.
  const double s = (1.5 * 1.5 - 1) / (1.5 * 1.5 + 1);
  EXPECT_NEAR(at_degrees(56.309932), s * s / 2, 1e-6);
}

TEST(Fresnel, DiffuseMeansMatchKnownValuesOnBothSides) {
  // ∫ F(cos θ) 2 cos θ d cos θ by the midpoint rule.
  constexpr int kSteps = 200'000;
  double out = 0, in = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double c = (i + 0.5) / kSteps;
    out += reflectance(c, 1.5) * 2 * c / kSteps;
    in += reflectance(c, 1 / 1.5) * 2 * c / kSteps;
  }
  EXPECT_NEAR(out, 0.0917780, 1e-6);
  EXPECT_NEAR(in, 0.5963458, 1e-5);
}

TEST(Fresnel, IsZeroAtIndexOne) {
  for (const double cos_i : {0.01, 0.5, 1.0}) {
    EXPECT_NEAR(reflectance(cos_i, 1.0), 0.0, 1e-8);
  }
}

}  // namespace
}  // namespace lightmill
