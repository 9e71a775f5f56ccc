#include "common/scene_io/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/vec.h"
#include "tests/fuzz/mutate.h"

namespace lightmill {
namespace {

using Corners = std::vector<std::array<double, 3>>;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

Vec3d doubled_area(const Corners& p, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const auto at = [&](std::uint32_t i) { return Vec3d(p[i][0], p[i][1], p[i][2]); };
  return glm::cross(at(b) - at(a), at(c) - at(a));
}

/// Checks that triangles cover an outline, each point once: all face like it, and their areas sum to its area.
void expect_cover(const Corners& corners, const Triangles& triangles, std::size_t count) {
  Vec3d outline(0);
  for (std::uint32_t i = 2; i < corners.size(); ++i) {
    outline += doubled_area(corners, 0, i - 1, i);
  }
  const double area = glm::length(outline);
  double sum = 0;
  for (const auto& [a, b, c] : triangles) {
    const Vec3d n = doubled_area(corners, a, b, c);
    EXPECT_GE(glm::dot(n, outline), -1e-12 * area * area);
    sum += glm::length(n);
  }
  EXPECT_NEAR(sum, area, 1e-12 * area);
  EXPECT_EQ(triangles.size(), count);
}

TEST(Polygon, ConvexPolygonsBecomeFans) {
  Triangles triangles;
  EXPECT_TRUE(triangulate(Corners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {-1, 0.5, 0}}, triangles));
  EXPECT_EQ(triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(Polygon, ConcavePolygonsAreCovered) {
  const std::vector<Corners> shapes{
      {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}},  // a dart, reflex at (1, 1)
      {{1, 1, 0}, {0, 4, 0}, {0, 0, 0}, {4, 0, 0}},  // … from its reflex corner
      {{4, 0, 0}, {1, 1, 0}, {0, 4, 0}, {0, 0, 0}},  // … where a fan spills
      {{0, 0, 3}, {0, 4, 3}, {4, 4, 3}, {4, 0, 3}, {3, 0, 3}, {3, 3, 3}, {1, 3, 3}, {1, 0, 3}},  // a U seen from behind
      // A square frame. An edge that is walked twice joins the hole.
      {{0, 0, 0}, {0, 3, 0}, {0, 3, 3}, {0, 0, 3}, {0, 0, 0}, {0, 1, 1}, {0, 1, 2}, {0, 2, 2}, {0, 2, 1}, {0, 1, 1}}};
  for (const Corners& corners : shapes) {
    Triangles triangles;
    EXPECT_TRUE(triangulate(corners, triangles));
    expect_cover(corners, triangles, corners.size() - 2);
  }
}

TEST(Polygon, RandomOutlinesAreCoveredInAnyPlane) {
  FuzzRandom random(7);
  const auto uniform = [&] { return static_cast<double>(random.below(1u << 20)) / (1u << 20); };
  for (int round = 0; round < 300; ++round) {
    const Vec3d u = glm::normalize(Vec3d(uniform() - 0.5, uniform() - 0.5, uniform() + 0.1));
    const Vec3d v = glm::normalize(glm::cross(u, Vec3d(uniform(), 1, uniform())));
    const Vec3d shift(100 * uniform(), 10 * uniform(), uniform());
    Corners corners;
    const std::size_t count = 4 + random.below(40);
    for (std::size_t i = 0; i < count; ++i) {  // star-shaped, so that it does not cross itself
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
      const double radius = 0.05 + uniform();
      const Vec3d p = shift + u * (radius * std::cos(angle)) + v * (radius * std::sin(angle));
      corners.push_back({p.x, p.y, p.z});
    }
    Triangles triangles;
    EXPECT_TRUE(triangulate(corners, triangles)) << round;
    expect_cover(corners, triangles, count - 2);
  }
}

TEST(Polygon, CornersOnAnEdgeLeaveNoGap) {
  // (2, 0) lies on the lower edge; the outline is concave at (2, 1).
  const Corners corners{{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {4, 3, 0}, {2, 1, 0}, {0, 3, 0}};
  Triangles triangles;
  EXPECT_TRUE(triangulate(corners, triangles));
  expect_cover(corners, triangles, 4);
}

TEST(Polygon, CrossingOutlinesAreReportedAndDegenerateOnesTerminate) {
  Triangles triangles;
  EXPECT_FALSE(triangulate(Corners{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}}, triangles));
  EXPECT_EQ(triangles.size(), 2u);
  for (const Corners& corners : {Corners(6, {1, 2, 3}), Corners{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}},
                                 Corners{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 0, 0}}}) {
    triangles.clear();
    triangulate(corners, triangles);
    EXPECT_LE(triangles.size(), corners.size() - 2);
  }
  // A comb with 1,000 teeth takes a moment only.
  Corners comb{{0, -1, 0}, {1000, -1, 0}};
  for (int i = 1000; i > 0; --i) {
    comb.push_back({static_cast<double>(i), 5, 0});
    comb.push_back({i - 0.5, 0, 0});
  }
  triangles.clear();
  EXPECT_TRUE(triangulate(comb, triangles));
  expect_cover(comb, triangles, comb.size() - 2);
}

}  // namespace
}  // namespace lightmill
