// Meshes of curved surfaces have the area and the sides of these.
#include "common/scene_io/tessellate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/vec.h"

namespace lightmill {
namespace {

Vec3d vec(const std::array<double, 3>& p) {
  return {p[0], p[1], p[2]};
}

/// Half the cross product of two edges: of the triangle's area, on its front side.
Vec3d area_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vec3d a = vec(mesh.positions[triangle[0]]);
  return 0.5 * glm::cross(vec(mesh.positions[triangle[1]]) - a, vec(mesh.positions[triangle[2]]) - a);
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) {
    sum += glm::length(area_of(mesh, triangle));
  }
  return sum;
}

TEST(Tessellation, DisksHaveTheirArea) {
  EXPECT_NEAR(area_of(disk_mesh(0, 360)), std::numbers::pi, 1e-12);
  EXPECT_NEAR(area_of(disk_mesh(0.5, 90)), std::numbers::pi * 0.75 / 4, 1e-12);
  const Mesh disk = disk_mesh(0, 360);
  for (const auto& triangle : disk.triangles) {
    EXPECT_GE(area_of(disk, triangle).z, 0);
  }
  ASSERT_TRUE(validate(disk).ok());
  EXPECT_EQ(disk.positions[0][1], 0);  // the seam is at +x
  EXPECT_GT(disk.positions[1][1], 0);  // u turns towards +y
}

TEST(Tessellation, CylindersHaveTheirAreaAndFaceOutwards) {
  const Mesh cylinder = cylinder_mesh(180);
  ASSERT_TRUE(validate(cylinder).ok());
  EXPECT_NEAR(area_of(cylinder), std::numbers::pi, 1e-12);
  for (const auto& triangle : cylinder.triangles) {
    const Vec3d at = vec(cylinder.positions[triangle[0]]);
    EXPECT_GT(glm::dot(area_of(cylinder, triangle), Vec3d(at.x, at.y, 0)), 0);
  }
}

TEST(Tessellation, ZonesOfSpheresHaveTheirAreaAndFaceOutwards) {
  for (const auto& [low, high, degrees] : {std::tuple{-1.0, 1.0, 360.0}, {0.0, 0.5, 90.0}}) {
    const Mesh zone = sphere_mesh(low, high, degrees);
    ASSERT_TRUE(validate(zone).ok());
    const double exact = degrees * std::numbers::pi / 180 * (high - low);  // Archimedes
    EXPECT_NEAR(area_of(zone), exact, 1e-3 * exact);
    for (const auto& triangle : zone.triangles) {
      if (glm::length(area_of(zone, triangle)) > 1e-9) {
        EXPECT_GT(glm::dot(area_of(zone, triangle), vec(zone.positions[triangle[1]])), 0);
      }
    }
  }
}

}  // namespace
}  // namespace lightmill
