// Emissive facets and spheres: points follow the density that is stated for rays which find the light by chance.
// The threshold of 5 standard deviations raises a false alarm once in 3.5 million tests.
#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

EmissiveFacet facet_of(const Vec3& a, const Vec3& b, const Vec3& c, bool whole) {
  return {a, b - a, c - a, kWhite, true, whole, 0};
}

/// Draws points of one facet as seen from p, and counts them over a grid on the facet. Compares with the integral of
/// the stated density per area. Grid and integral use only the facet's affine coordinates.
double facet_z(std::uint32_t seed, const EmissiveFacet& facet, const Vec3& p) {
  constexpr int kCells = 16, kSub = 16;
  LightTable table;
  table.facets.add(facet);
  table.build();
  const Vec3d corner(facet.corner), e1(facet.edge1), e2(facet.edge2), n = glm::cross(e1, e2);
  std::vector<double> counts(kCells * kCells), expected(kCells * kCells);
  for_each_draw(seed, [&](Pair8, Pair8 u) {
    const LightSample8 s = table.sample(broadcast(p), 0, kNoChoice, u);
    ASSERT_EQ(s.valid.bits(), 255);
    const VectorLanes point(s.point);
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3d d = point[lane] - corner;
      const double b1 = glm::dot(glm::cross(d, e2), n) / glm::dot(n, n);
      const double b2 = glm::dot(glm::cross(e1, d), n) / glm::dot(n, n);
      ASSERT_GT(b1, -1e-4);
      ASSERT_GT(b2, -1e-4);
      ASSERT_LT(facet.parallelogram ? std::max(b1, b2) : b1 + b2, 1 + 1e-4);
      const int i = std::clamp(static_cast<int>(b1 * kCells), 0, kCells - 1);
      const int j = std::clamp(static_cast<int>(b2 * kCells), 0, kCells - 1);
      counts[i * kCells + j] += 1;
    }
  });
  for (int i = 0; i < kCells * kSub; ++i) {
    for (int j = 0; j < kCells * kSub; ++j) {
      // The diagonal halves some subcells.
      const double b1 = (i + 0.5) / (kCells * kSub), b2 = (j + 0.5) / (kCells * kSub);
      const double share = facet.parallelogram || i + j < kCells * kSub - 1 ? 1 : i + j == kCells * kSub - 1 ? 0.5 : 0;
      const Vec3d d = corner + e1 * b1 + e2 * b2 - Vec3d(p);
      const double distance = glm::length(d), cosine = std::abs(glm::dot(d, n)) / (distance * glm::length(n));
      const F8 pdf = table.pdf_solid_angle(broadcast(p), U8(0u), F8(static_cast<float>(distance)),
                                           F8(static_cast<float>(cosine)), M8(true));
      expected[i / kSub * kCells + j / kSub] += kDraws * share * Lanes(pdf)[0] * cosine / (distance * distance) *
                                                glm::length(n) / (kCells * kSub * kCells * kSub);
    }
  }
  double total = 0;
  for (const double e : expected) {
    total += e;
  }
  EXPECT_NEAR(total / kDraws, 1, 2e-3);
  return chi_squared_z(counts, expected);
}

TEST(SurfaceLights, TrianglesFollowTheirDensityFarAndNear) {
  const Vec3 a(1, 2, 3), b(2, 2.5f, 3), c(1.2f, 3, 3.7f);
  // By area when far, by solid angle when near. One point is beside an edge, and one just above it.
  for (const Vec3& p : {Vec3(-9, 3, 1), Vec3(0.3f, 1.9f, 2.5f), Vec3(1.4f, 2.4f, 2.9f), Vec3(1.5f, 2.1f, 3.3f)}) {
    EXPECT_LT(facet_z(1, facet_of(a, b, c, false), p), kChiSquaredThreshold) << p.x;
  }
  // A needle seen from near its tip.
  EXPECT_LT(facet_z(2, facet_of({0, 0, 0}, {10, 0, 0}, {5, 0.1f, 0}, false), {0.4f, 0.3f, 0.5f}), kChiSquaredThreshold);
  // Large and near, so that it fills almost a hemisphere.
  EXPECT_LT(facet_z(3, facet_of({-30, -20, 0}, {30, -20, 0}, {0, 40, 0}, false), {0, 0, 2}), kChiSquaredThreshold);
}

TEST(SurfaceLights, SmallSpheresKeepTheirIrradiance) {
  // E = πL (R/d)² on a surface that faces the sphere. Every sample must count, with the same weight except for the
  // cosine.
  for (const double ratio : {1e-1, 1e-2, 1.4e-3, 3.5e-4, 2.8e-4, 1e-4, 1e-5}) {
    for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0.3f, -0.8f, 0.4f), Vec3(-1, 2, 3)}) {
      LightTable table;
      const Vec3 p(0.1f, -0.2f, 0.3f), n = glm::normalize(direction);
      table.spheres.add({p + n * 10.0f, static_cast<float>(10 * ratio), kWhite, false, false, 0});
      table.build();
      double sum = 0;
      for_each_draw(9, [&](Pair8, Pair8 u) {
        const LightSample8 s = table.sample(broadcast(p), 0, kNoChoice, u);
        const Lanes value(masked(s.valid, s.weight.x * dot(s.wi, broadcast(n))));
        for (int lane = 0; lane < 8; ++lane) {
          sum += value[lane];
        }
      });
      // The radius is known to 6e-8. The noise of the mean cosine is below R²/d² over the root of the draws.
      EXPECT_NEAR(sum / kDraws / (M_PI * ratio * ratio), 1, 1e-5 + 3e-3 * ratio * ratio) << ratio;
    }
  }
}

TEST(SurfaceLights, ParallelogramsFollowTheirDensity) {
  const EmissiveFacet facet = facet_of({-1, -0.5f, 2}, {0.5f, -0.3f, 2.1f}, {-0.7f, 0.5f, 1.6f}, true);
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(-0.5f, 0, 1.7f), Vec3(5, -3, 2)}) {
    EXPECT_LT(facet_z(4, facet, p), kChiSquaredThreshold) << p.x;
  }
}

TEST(SurfaceLights, NearTrianglesAreUniformPerSolidAngle) {
  // Van Oosterom and Strackee's formula in double precision is the density's inverse.
  const Vec3 a(-0.3f, 0.2f, 1), b(0.9f, -0.4f, 0.8f), c(0.1f, 1.1f, 0.9f);
  LightTable table;
  table.facets.add(facet_of(a, b, c, false));
  table.build();
  const Vec3d u = glm::normalize(Vec3d(a)), v = glm::normalize(Vec3d(b)), w = glm::normalize(Vec3d(c));
  const double solid_angle =
      2 * std::atan2(std::abs(glm::dot(u, glm::cross(v, w))), 1 + glm::dot(u, v) + glm::dot(v, w) + glm::dot(w, u));
  for_each_draw(5, [&](Pair8, Pair8 pair) {
    const Lanes pdf(table.sample(broadcast(Vec3(0)), 0, kNoChoice, pair).pdf_solid_angle);
    for (int lane = 0; lane < 8; ++lane) {
      ASSERT_NEAR(pdf[lane] * solid_angle, 1, 2e-5);
    }
  });
}

TEST(SurfaceLights, SpheresFromOutsideAreUniformInTheirCone) {
  LightTable table;
  table.spheres.add({{0, 0, 4}, 2.4f, kWhite, false, false, 0});  // sin θmax = .6, cos θmax = .8
  table.build();
  const double density = 1 / (2 * M_PI * 0.2);
  constexpr int kHeights = 20, kSectors = 20;
  std::vector<double> counts(kHeights * kSectors), expected(kHeights * kSectors, kDraws / double{kHeights * kSectors});
  for_each_draw(6, [&](Pair8, Pair8 u) {
    const LightSample8 s = table.sample(broadcast(Vec3(0)), 0, kNoChoice, u);
    const VectorLanes wi(s.wi);
    const Lanes pdf(s.pdf_solid_angle);
    for (int lane = 0; lane < 8; ++lane) {
      ASSERT_NEAR(pdf[lane] / density, 1, 1e-4);
      ASSERT_GE(wi[lane].z, 0.8 - 1e-5);
      const double height = (1 - wi[lane].z) / 0.2, turn = std::atan2(wi[lane].y, wi[lane].x) / (2 * M_PI) + 0.5;
      counts[std::min(kHeights - 1, static_cast<int>(height * kHeights)) * kSectors +
             std::min(kSectors - 1, static_cast<int>(turn * kSectors))] += 1;
    }
  });
  EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold);
}

TEST(SurfaceLights, SpheresFromInsideCoverAllDirections) {
  LightTable table;
  table.spheres.add({{0.5f, 0, 0}, 2, kWhite, true, false, 0});
  table.build();
  double sum = 0;
  for_each_draw(7, [&](Pair8, Pair8 u) {
    const LightSample8 s = table.sample(broadcast(Vec3(0.2f, 0.9f, -0.4f)), 0, kNoChoice, u);
    EXPECT_EQ(s.valid.bits(), 255);
    for (int lane = 0; lane < 8; ++lane) {
      sum += 1 / Lanes(s.pdf_solid_angle)[lane];
    }
  });
  EXPECT_NEAR(sum / kDraws / (4 * M_PI), 1, 0.01);
}

/// The density that `sample` states and the density of a ray to the same point differ only by rounding.
void expect_same_density(const LightTable& table, std::uint32_t light, const Vec3& p, const Vec3d& normal_center,
                         const Vec3d& flat_normal) {
  for_each_draw(8, [&](Pair8, Pair8 u) {
    const LightSample8 s = table.sample(broadcast(p), 0, kNoChoice, u);
    const VectorLanes point(s.point), wi(s.wi);
    const Lanes pdf(s.pdf_solid_angle);
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3d normal = flat_normal != Vec3d(0) ? flat_normal : glm::normalize(point[lane] - normal_center);
      const double cosine = std::abs(glm::dot(wi[lane], normal));
      const double distance = glm::length(point[lane] - Vec3d(p));
      if (cosine < 0.02) {
        continue;  // the small offset of points from the surface matters here
      }
      const double found = Lanes(table.pdf_solid_angle(broadcast(p), U8(light), F8(static_cast<float>(distance)),
                                                       F8(static_cast<float>(cosine)), M8(true)))[0];
      ASSERT_NEAR(found / pdf[lane], 1, 2e-3);
    }
  });
}

TEST(SurfaceLights, RaysThatFindALightHaveTheDensityOfItsSamples) {
  LightTable facet, sphere;
  facet.facets.add(facet_of({1, 2, 3}, {2, 2.5f, 3}, {1.2f, 3, 3.7f}, false));
  facet.build();
  const Vec3d n = glm::normalize(glm::cross(Vec3d(1, 0.5, 0), Vec3d(0.2, 1, 0.7)));
  expect_same_density(facet, 0, {0.3f, 1.9f, 2.5f}, Vec3d(0), n);
  expect_same_density(facet, 0, {-5, 1.9f, 2.5f}, Vec3d(0), n);
  sphere.spheres.add({{1, 0, 0}, 0.5f, kWhite, false, false, 0});
  sphere.build();
  expect_same_density(sphere, 0, {-0.3f, 0.4f, 0.2f}, {1, 0, 0}, Vec3d(0));
}

TEST(SurfaceLights, ProfilesChangeTheRadianceAndNothingElse) {
  for (const float exponent : {0.5f, 1.0f, 20.0f}) {
    LightTable flat, shaped;
    EmissiveFacet facet = facet_of({-1, -1, 2}, {1, -1, 2.5f}, {-1, 1, 2}, true);
    flat.facets.add(facet);
    facet.exponent = exponent;
    shaped.facets.add(facet);
    flat.build();
    shaped.build();
    const Vec3d normal = glm::normalize(glm::cross(Vec3d(facet.edge1), Vec3d(facet.edge2)));
    for_each_draw(9, [&](Pair8, Pair8 u) {
      const LightSample8 a = flat.sample(broadcast(Vec3(0)), 0, kNoChoice, u);
      const LightSample8 b = shaped.sample(broadcast(Vec3(0)), 0, kNoChoice, u);
      const Lanes pdf_a(a.pdf_solid_angle), pdf_b(b.pdf_solid_angle), weight_a(a.weight.x), weight_b(b.weight.x);
      const VectorLanes wi(a.wi);
      for (int lane = 0; lane < 8; ++lane) {
        const double profile = std::pow(std::abs(glm::dot(wi[lane], normal)), exponent);
        ASSERT_EQ(pdf_a[lane], pdf_b[lane]);
        ASSERT_NEAR(weight_b[lane], weight_a[lane] * profile, 2e-5 * weight_a[lane]);
      }
    });
  }
}

}  // namespace
}  // namespace lightmill::test
