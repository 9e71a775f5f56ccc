// The phase function, with 100,000 draws each. The threshold raises a false alarm once in 3.5 million tests.
#include "common/materials/henyey_greenstein.h"
#include "tests/analytic/materials/bsdf_checks.h"

namespace lightmill::test {
namespace {

TEST(HenyeyGreenstein, DrawsWhatItsPdfSaysWithMeanCosineG) {
  std::uint32_t seed = 1300;
  for (const double g : {0.0, 1e-4, 0.3, -0.3, 0.8, -0.8, 0.99, -0.99}) {
    const HenyeyGreenstein8 phase{F8(static_cast<float>(g))};
    const Vec3d from = glm::normalize(Vec3d(0.3, -0.5, 0.7));
    const V8 wo = to_lanes(from);
    const Grid grid(from, -from, std::min(1 - std::abs(g), 0.3));
    std::vector<double> counts(Grid::kCells), expected(Grid::kCells);
    double cosine = 0;
    ++seed;
    for (int i = 0; i < kDraws; i += 8) {
      const V8 wi = phase.sample(wo, hashed_pair(U8(static_cast<std::uint32_t>(i)) + U8::lane_index(), U8(mix(seed))));
      const Lanes x(wi.x), y(wi.y), z(wi.z);
      for (int lane = 0; lane < 8; ++lane) {
        const Vec3d w(x[lane], y[lane], z[lane]);
        counts[grid.cell(w)] += 1;
        cosine -= glm::dot(w, from) / kDraws;
      }
    }
    double integral = 0;
    grid.for_each_point([&](int cell, const V8& wi, F8 omega) {
      const Lanes p(phase.pdf_solid_angle(wo, wi) * omega);
      for (int lane = 0; lane < 8; ++lane) {
        expected[cell] += kDraws * p[lane];
        integral += p[lane];
      }
    });
    EXPECT_NEAR(integral, 1, 1e-3) << g;
    EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold) << g;
    EXPECT_NEAR(cosine, g, 5 / std::sqrt(kDraws)) << g;
  }
}

TEST(HenyeyGreenstein, IsReciprocalAndDependsOnlyOnTheAngle) {
  for (const double g : {0.0, 0.4, -0.7, 0.95}) {
    const HenyeyGreenstein8 phase{F8(static_cast<float>(g))};
    for (int i = 0; i < 200; ++i) {
      const double cosine = 1 - 2 * (i + 0.5) / 200, sine = std::sqrt(1 - cosine * cosine), turn = 2.4 * i;
      const Vec3d wo = glm::normalize(Vec3d(0.3, -0.5, 0.7)), s = glm::normalize(glm::cross(wo, Vec3d(0, 0, 1)));
      const Vec3d t = glm::cross(wo, s);
      const Vec3d wi = -wo * cosine + (s * std::cos(turn) + t * std::sin(turn)) * sine;
      const double there = Lanes(phase.pdf_solid_angle(to_lanes(wo), to_lanes(wi)))[0];
      const double back = Lanes(phase.pdf_solid_angle(to_lanes(wi), to_lanes(wo)))[0];
      const double exact = (1 - g * g) / (4 * M_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5));
      EXPECT_EQ(there, back) << g << ' ' << cosine;
      EXPECT_NEAR(there, exact, 1e-4 * exact) << g << ' ' << cosine;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
