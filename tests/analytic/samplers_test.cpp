// Chi-squared tests of every sampler: draws of `sample` have the density that `pdf` states. There are 200,000 draws
// each. The threshold of 5 standard deviations raises a false alarm once in 3.5 million tests.
#include <gtest/gtest.h>

#include <cmath>

#include "common/sampling/discrete.h"
#include "common/sampling/filter_table.h"
#include "common/sampling/warp.h"
#include "tests/support/chi_squared.h"
#include "tests/support/lanes.h"

namespace lightmill {
namespace {

using test::chi_squared_z;
using test::kChiSquaredThreshold;
using test::Lanes;

constexpr int kDraws = 200'000;

/// Calls `draw(pair, callback)` on independent random pairs, lane by lane.
template <class Draw>
void for_each_draw(std::uint32_t seed, Draw draw) {
  for (int i = 0; i < kDraws; i += 8) {
    draw(hashed_pair(U8(static_cast<std::uint32_t>(i)) + U8::lane_index(), U8(mix(seed))));
  }
}

/// Histogram over (cos θ, φ) of directions on the sphere, compared with a density per solid angle.
template <class Density>
double direction_z(std::uint32_t seed, const std::function<V8(Pair8)>& sample, Density density) {
  constexpr int kTheta = 20, kPhi = 20, kSub = 16;
  std::vector<double> counts(kTheta * kPhi), expected(kTheta * kPhi);
  for_each_draw(seed, [&](Pair8 u) {
    const V8 w = sample(u);
    const Lanes x(w.x), y(w.y), z(w.z);
    for (int l = 0; l < 8; ++l) {
      EXPECT_NEAR(x[l] * x[l] + y[l] * y[l] + z[l] * z[l], 1, 1e-5);
      double phi = std::atan2(y[l], x[l]) / (2 * M_PI);
      phi = phi < 0 ? phi + 1 : phi;
      const int i = std::clamp(static_cast<int>((z[l] + 1) / 2 * kTheta), 0, kTheta - 1);
      const int j = std::clamp(static_cast<int>(phi * kPhi), 0, kPhi - 1);
      counts[i * kPhi + j] += 1;
    }
  });
  for (int i = 0; i < kTheta; ++i) {
    for (int s = 0; s < kSub; ++s) {
      const double z = -1 + 2 * (i + (s + 0.5) / kSub) / kTheta;
      for (int j = 0; j < kPhi; ++j) {
        expected[i * kPhi + j] += kDraws * density(z) * (2.0 / kTheta / kSub) * (2 * M_PI / kPhi);
      }
    }
  }
  return chi_squared_z(counts, expected);
}

TEST(Samplers, TheChiSquaredTestFindsAWrongDensity) {
  const double z = direction_z(1, square_to_cosine_hemisphere, [](double z) { return z > 0 ? 1 / (2 * M_PI) : 0.0; });
  EXPECT_GT(z, 50);
}

TEST(Samplers, CosineHemisphereFollowsItsDensity) {
  const double z = direction_z(2, square_to_cosine_hemisphere, [](double z) { return std::max(z, 0.0) / M_PI; });
  EXPECT_LT(z, kChiSquaredThreshold);
}

TEST(Samplers, UniformSphereFollowsItsDensity) {
  EXPECT_LT(direction_z(5, square_to_sphere, [](double) { return 1 / (4 * M_PI); }), kChiSquaredThreshold);
}

TEST(Samplers, UniformConeFollowsItsDensity) {
  for (const float one_minus_cos : {0.2f, 0.7f, 1.0f}) {
    const double cos_max = 1 - one_minus_cos;
    const double pdf = Lanes(cone_pdf_solid_angle(F8(one_minus_cos)))[0];
    // direction_z's subcells integrate the cells at the rim well only if the rim falls between subcells. It does for
    // these values (multiples of 1/160).
    const double z = direction_z(
        6, [&](Pair8 u) { return square_to_cone(u, F8(one_minus_cos)); },
        [&](double z) { return z > cos_max ? pdf : 0.0; });
    EXPECT_LT(z, kChiSquaredThreshold) << one_minus_cos;
  }
}

TEST(Samplers, DiskAndTriangleAreUniformByArea) {
  constexpr int kCells = 16;
  std::vector<double> disk(kCells * kCells), triangle(kCells * kCells), flat(kCells * kCells, kDraws / 256.0);
  for_each_draw(7, [&](Pair8 u) {
    const Pair8 d = square_to_disk(u);
    const Pair8 t = square_to_triangle(u);
    const Lanes dx(d.u), dy(d.v), b1(t.u), b2(t.v);
    for (int l = 0; l < 8; ++l) {
      const double r2 = dx[l] * dx[l] + dy[l] * dy[l];
      double phi = std::atan2(dy[l], dx[l]) / (2 * M_PI);
      phi = phi < 0 ? phi + 1 : phi;
      ASSERT_LE(r2, 1 + 1e-6);
      disk[std::min<int>(kCells - 1, static_cast<int>(r2 * kCells)) * kCells +
           std::min<int>(kCells - 1, static_cast<int>(phi * kCells))] += 1;
      ASSERT_GE(b1[l], 0);
      ASSERT_GE(b2[l], 0);
      ASSERT_LE(b1[l] + b2[l], 1 + 1e-6);
      // Uniform on the triangle: s = b1 + b2 has density 2s, b1/s is uniform.
      const double s = b1[l] + b2[l];
      const double ratio = s > 0 ? b1[l] / s : 0;
      triangle[std::min<int>(kCells - 1, static_cast<int>(s * s * kCells)) * kCells +
               std::min<int>(kCells - 1, static_cast<int>(ratio * kCells))] += 1;
    }
  });
  EXPECT_LT(chi_squared_z(disk, flat), kChiSquaredThreshold);
  EXPECT_LT(chi_squared_z(triangle, flat), kChiSquaredThreshold);
}

TEST(Samplers, PixelFilterOffsetsFollowTheFilter) {
  const auto tent = [](double x) { return 1 - std::abs(x) / 1.5; };
  const FilterTable table(1.5, tent);
  constexpr int kCells = 60;
  std::vector<double> counts(kCells), expected(kCells);
  for_each_draw(8, [&](Pair8 u) {
    const Lanes x(table.sample(u.u));
    for (int l = 0; l < 8; ++l) {
      ASSERT_LE(std::abs(x[l]), 1.5f);
      counts[std::min(kCells - 1, static_cast<int>((x[l] + 1.5) / 3 * kCells))] += 1;
    }
  });
  for (int i = 0; i < kCells; ++i) {
    const double middle = -1.5 + 3 * (i + 0.5) / kCells;
    expected[i] = kDraws * tent(middle) * (3.0 / kCells) / 1.5;
  }
  EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold);
}

TEST(Samplers, DiscreteChoiceFollowsItsWeights) {
  const std::vector<double> weights{0, 3, 0, 0, 1, 10, 0.5, 0};
  const DiscreteDistribution distribution(weights);
  std::vector<double> counts(weights.size()), expected(weights.size());
  for_each_draw(9, [&](Pair8 u) {
    const auto chosen = distribution.sample(u.u);
    alignas(32) std::uint32_t index[8];
    chosen.index.store(index);
    const Lanes pmf(chosen.pmf);
    for (int l = 0; l < 8; ++l) {
      counts[index[l]] += 1;
      ASSERT_NEAR(pmf[l], weights[index[l]] / 14.5, 1e-6);
    }
  });
  for (std::size_t i = 0; i < weights.size(); ++i) {
    expected[i] = kDraws * weights[i] / 14.5;
  }
  EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold);
}

}  // namespace
}  // namespace lightmill
