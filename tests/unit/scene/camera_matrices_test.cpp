#include "common/scene/camera_matrices.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill {
namespace {

std::array<double, 4> times(const Point3d& p, const ImageMatrix& m) {
  std::array<double, 4> out{};
  for (std::size_t j = 0; j < 4; ++j) {
    out[j] = p[0] * m[j] + p[1] * m[4 + j] + p[2] * m[8 + j] + m[12 + j];
  }
  return out;
}

void expect_camera(const CameraMatrices& m, const Point3d& p, const Point3d& expected) {
  const auto got = times(p, m.world_to_camera);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(got[i], expected[i], 1e-5) << i;
  }
  EXPECT_EQ(got[3], 1);
}

void expect_ndc(const CameraMatrices& m, const Point3d& p, double x, double y) {
  const auto got = times(p, m.world_to_ndc);
  EXPECT_NEAR(got[0] / got[3], x, 1e-5);
  EXPECT_NEAR(got[1] / got[3], y, 1e-5);
  EXPECT_GT(got[3], 0);
}

TEST(CameraMatrices, MapKnownPointsOfALevelCamera) {
  // From (1, 2, 3) along −z; at distance 1 the picture is 2 high and 4 wide.
  const CameraMatrices m = camera_matrices({{1, 2, 3}, {1, 2, 1}, {0, 5, 1}, 90}, 200, 100);
  expect_camera(m, {1, 2, 3}, {0, 0, 0});
  expect_camera(m, {2, 4, -1}, {1, 2, 4});  // right, up, ahead
  expect_ndc(m, {1, 2, -7}, 0.5, 0.5);
  expect_ndc(m, {1 - 4, 2 + 2, 1}, 0, 0);
  expect_ndc(m, {1 + 4, 2 - 2, 1}, 1, 1);
  expect_ndc(m, {1 + 2, 2, 2}, 1, 0.5);
}

TEST(CameraMatrices, MapKnownPointsOfACameraThatLooksDown) {
  // Down from (0, 10, 0), x upwards in the picture: then z is to the right.
  const CameraMatrices m = camera_matrices({{0, 10, 0}, {0, 0, 0}, {1, 0, 0}, 2 * std::atan(0.5) * 180 / M_PI}, 1, 1);
  expect_camera(m, {3, 0, 4}, {4, 3, 10});
  expect_ndc(m, {5, 0, 0}, 0.5, 0);
  expect_ndc(m, {0, 0, 5}, 1, 0.5);
}

TEST(CameraMatrices, MapKnownPointsOfAShiftedCamera) {
  // At distance 1 the picture is 2 high and 4 wide, and its centre is 1 to the right and 0.5 up.
  const CameraMatrices m = camera_matrices({{1, 2, 3}, {1, 2, 1}, {0, 5, 1}, 90, 0, 0, 0.5, 0.25}, 200, 100);
  expect_camera(m, {2, 4, -1}, {1, 2, 4});
  expect_ndc(m, {1 + 1, 2 + 0.5, 2}, 0.5, 0.5);
  expect_ndc(m, {1 + 1 - 2, 2 + 0.5 + 1, 2}, 0, 0);
  expect_ndc(m, {1 + 10 + 20, 2 + 5 - 10, -7}, 1, 1);
}

}  // namespace
}  // namespace lightmill
