// Formulas for unshadowed irradiance, compared with the mean of light samples.
#include "common/lights/unoccluded_irradiance.h"

#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

/// Five standard errors raise a false alarm once in 1.7 million comparisons. 1e-5 is for rounding.
void expect_mean_of_samples(LightTable table, const Vec3& p, const Vec3& normal) {
  table.build();
  const Vec3 n = glm::normalize(normal);
  double sum = 0, squares = 0;
  for_each_draw(7, [&](Pair8, Pair8 u) {
    const LightSample8 s = table.sample(broadcast(p), 0, kNoChoice, u);
    const Lanes value(masked(s.valid, s.weight.y * max(dot(s.wi, broadcast(n)), F8(0.0f))));
    for (int lane = 0; lane < 8; ++lane) {
      sum += value[lane];
      squares += value[lane] * value[lane];
    }
  });
  const double mean = sum / kDraws;
  const double standard_error = std::sqrt(std::max(squares / kDraws - mean * mean, 0.0) / kDraws);
  const UnoccludedIrradiance unoccluded(table);
  const VectorLanes exact(unoccluded.at(table, broadcast(p), broadcast(n), M8(true)));
  EXPECT_NEAR(exact[3].y, mean, 5 * standard_error + 1e-5 * mean) << p.x << ' ' << normal.x;
  EXPECT_EQ(exact[3].x, exact[5].x);
}

LightTable with(const EmissiveFacet& facet) {
  LightTable table;
  table.facets.add(facet);
  return table;
}

TEST(UnoccludedIrradiance, MatchesSamplesOfTrianglesAndParallelograms) {
  const EmissiveFacet triangle{{-1, 2, -1}, {2, 0.3f, 0}, {0.2f, 0, 2.5f}, {1, 3, 2}, true, false, 0};
  EmissiveFacet whole = triangle;
  whole.parallelogram = true;
  for (const EmissiveFacet& facet : {triangle, whole}) {
    expect_mean_of_samples(with(facet), {0, 0, 0}, {0, 1, 0});        // all above the horizon
    expect_mean_of_samples(with(facet), {0, 1.9f, 0}, {1, 0.2f, 0});  // cut by the horizon, near
    expect_mean_of_samples(with(facet), {0, 2.5f, 0}, {0.1f, -1, 0.4f});
    expect_mean_of_samples(with(facet), {3, 2, 4}, {-1, 0.1f, 0});  // almost edge on
    expect_mean_of_samples(with(facet), {0, 0, 0}, {0, -1, 0});     // all below
  }
  // The side that does not emit.
  EmissiveFacet one_sided = triangle;
  one_sided.two_sided = false;
  expect_mean_of_samples(with(one_sided), {0, 0, 0}, {0, 1, 0});
  expect_mean_of_samples(with(one_sided), {0, 5, 0}, {0, -1, 0});
}

TEST(UnoccludedIrradiance, MatchesSamplesOfSpheres) {
  EmissiveSphere sphere{{0, 1, 0}, 0.7f, {1, 3, 2}, false, false, 0};
  for (const Vec3& n : {Vec3(0, 1, 0), Vec3(1, 0.3f, 0), Vec3(1, 0, 0), Vec3(1, -0.4f, 0.1f), Vec3(0, -1, 0)}) {
    LightTable table;
    table.spheres.add(sphere);
    expect_mean_of_samples(std::move(table), {0, 0, 0}, n);
  }
  sphere.inward = true;
  for (const Vec3& p : {Vec3(0.1f, 1.2f, 0), Vec3(0, 0, 0)}) {
    LightTable table;
    table.spheres.add(sphere);
    expect_mean_of_samples(std::move(table), p, {0.3f, 1, 0});
  }
}

TEST(UnoccludedIrradiance, MatchesSamplesOfPointsAndDirections) {
  LightTable point, spot, cosine, sun;
  point.points.add({{1, 2, 3}, {1, 3, 2}});
  spot.spots.add({{1, 2, 3}, glm::normalize(Vec3(-1, -2, -2)), {1, 3, 2}, 0.01f, 0.2f});
  cosine.cosine_powers.add({{1, 2, 3}, {0, -1, 0}, {1, 3, 2}, 2.5f});
  sun.directional.add({glm::normalize(Vec3(-1, -2, -3)), {1, 3, 2}});
  for (const LightTable& table : {point, spot, cosine, sun}) {
    expect_mean_of_samples(table, {0, 0, 0}, {0, 1, 0});
    expect_mean_of_samples(table, {0, 0, 0}, {-1, -1, 0});
  }
}

TEST(UnoccludedIrradiance, ADiskGivesItsFormFactor) {
  // E/(πL) = r²/(r² + h²) on the axis. Perpendicular to it, at distance h, (1/π)(atan(1/s) − s/(1 + s²)) with s = h/r.
  for (const double h : {0.3, 1.0, 7.0}) {
    LightTable table;
    table.disks.add({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 1, 1}});
    const double s = h / 2;
    EXPECT_NEAR(table.disks.irradiance(0, {0, 0, h}, {0, 0, -1}).x / M_PI, 4 / (4 + h * h), 1e-3);
    EXPECT_NEAR(table.disks.irradiance(0, {0, 0, h}, {1, 0, 0}).x / M_PI, (std::atan(1 / s) - s / (1 + s * s)) / M_PI,
                1e-3);
    EXPECT_EQ(table.disks.irradiance(0, {0, 0, -h}, {0, 0, 1}).x, 0);
  }
}

TEST(UnoccludedIrradiance, ARectangleGivesItsFormFactor) {
  // Each quarter has a corner above the point: E/(πL) = 4/(2π) (a/√(1 + a²) atan(b/√(1 + a²)) + the same of (b, a)).
  LightTable table;
  table.disks.add({{0, 0, 0}, {2, 0, 0}, {0, 0.5f, 0}, {1, 1, 1}, M_PI, true});
  const auto half = [](double a, double b) { return a / std::hypot(1, a) * std::atan(b / std::hypot(1, a)); };
  for (const double h : {0.3, 1.0, 7.0}) {
    EXPECT_NEAR(table.disks.irradiance(0, {0, 0, h}, {0, 0, -1}).x / M_PI,
                2 / M_PI * (half(2 / h, 0.5 / h) + half(0.5 / h, 2 / h)), 1e-12);
  }
}

TEST(UnoccludedIrradiance, MatchesSamplesOfABall) {
  for (const Vec3& normal : {Vec3(0, 1, 0), Vec3(1, 0.1f, 0), Vec3(0.3f, 0, 1), Vec3(0, -1, 0.4f)}) {
    LightTable table;
    table.points.add({{1.2f, 4, 3.1f}, {1, 2, 3}, 1.5f});
    expect_mean_of_samples(table, {1, 2, 3}, normal);
  }
}

TEST(UnoccludedIrradiance, MatchesSamplesOfASunsDisk) {
  // High, cut by the horizon, and set.
  for (const float diameter : {0.5f, 20.0f, 120.0f}) {
    const auto angle = static_cast<float>(1 - std::cos(diameter * M_PI / 360));
    for (const Vec3& normal : {Vec3(0, 1, 0), Vec3(1, 0.1f, 0), Vec3(0.3f, 0, 1), Vec3(0, -1, 0.4f)}) {
      LightTable table;
      table.directional.add({glm::normalize(Vec3(0.01f, -1, 0.02f)), {1, 2, 3}, angle});
      expect_mean_of_samples(table, {1, 2, 3}, normal);
    }
  }
}

TEST(UnoccludedIrradiance, MatchesTheSumOverAnEnvironmentImage) {
  // Clear sky with a sun over darker ground, turned. The integral is a sum over directions.
  constexpr int kWidth = 16, kHeight = 8;
  std::vector<float> rgb;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const float base = i / kWidth < kHeight / 2 ? 1.0f : 0.3f;
    rgb.insert(rgb.end(), {base, base * static_cast<float>(1 + i % 3), i == 21 ? 300 : base});
  }
  LightTable table;
  table.environment =
      EnvironmentRadiance({.rgb = rgb, .width = kWidth, .height = kHeight, .rotation_degrees = 33}, {1, 2, 1});
  table.build();
  const UnoccludedIrradiance unoccluded(table);
  for (const Vec3& normal : {Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(1, 0.2f, 0.3f), Vec3(-1, 0, -1), Vec3(-0.3f, -1, 2)}) {
    const Vec3 n = glm::normalize(normal);
    constexpr int kRows = 1000, kColumns = 2000;
    Vec3d sum(0);
    for (int row = 0; row < kRows; ++row) {
      const double theta = M_PI * (row + 0.5) / kRows;
      for (int column = 0; column < kColumns; column += 8) {
        alignas(32) float d[3][8];
        double cosine[8];
        for (int lane = 0; lane < 8; ++lane) {
          const double phi = 2 * M_PI * (column + lane + 0.5) / kColumns;
          const Vec3d direction(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
          cosine[lane] = std::max(glm::dot(direction, Vec3d(n)), 0.0);
          d[0][lane] = static_cast<float>(direction.x);
          d[1][lane] = static_cast<float>(direction.y);
          d[2][lane] = static_cast<float>(direction.z);
        }
        const VectorLanes radiance(table.environment.radiance({F8::load(d[0]), F8::load(d[1]), F8::load(d[2])}));
        for (int lane = 0; lane < 8; ++lane) {
          sum += radiance[lane] * (cosine[lane] * std::sin(theta) * (M_PI / kRows) * (2 * M_PI / kColumns));
        }
      }
    }
    const VectorLanes got(unoccluded.at(table, broadcast(Vec3(0)), broadcast(n), M8(true)));
    for (int color = 0; color < 3; ++color) {
      EXPECT_NEAR(got[2][color], sum[color], 5e-3 * sum[color]) << normal.x << ' ' << color;
    }
  }
}

TEST(UnoccludedIrradiance, IsPiTimesAConstantEnvironment) {
  LightTable table;
  table.environment = EnvironmentRadiance({1, 2, 3});
  table.build();
  const VectorLanes got(UnoccludedIrradiance(table).at(table, broadcast(Vec3(0)), broadcast(Vec3(0, 0, 1)), M8(true)));
  EXPECT_NEAR(got[0].z, 3 * M_PI, 1e-5);
}

}  // namespace
}  // namespace lightmill::test
