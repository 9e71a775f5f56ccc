#include "common/scene/camera_matrices.h"

#include <cmath>
#include <numbers>

namespace lightmill {
namespace {

/// The matrix whose column j gives column[j] · (p − eye) + constant[j].
ImageMatrix matrix_of(const std::array<Point3d, 4>& columns, const std::array<double, 4>& constants,
                      const Point3d& eye) {
  ImageMatrix out{};
  for (std::size_t j = 0; j < 4; ++j) {
    for (std::size_t i = 0; i < 3; ++i) {
      out[4 * i + j] = static_cast<float>(columns[j][i]);
    }
    out[12 + j] = static_cast<float>(constants[j] - dot(columns[j], eye));
  }
  return out;
}

}  // namespace

CameraMatrices camera_matrices(const Camera& camera, double width, double height) {
  const Point3d& eye = camera.eye;
  const Point3d ahead = normalize(difference(camera.look_at, eye));
  const Point3d right = normalize(cross(ahead, normalize(camera.up)));
  const Point3d up = cross(right, ahead);
  // Half the picture's height and width at distance 1.
  const double y = std::tan(camera.vertical_fov_degrees / 2 * std::numbers::pi / 180), x = y * width / height;
  const double center_x = 0.5 - camera.shift_x * height / width, center_y = 0.5 + camera.shift_y;  // of `ahead`
  Point3d across, down;
  for (std::size_t i = 0; i < 3; ++i) {
    across[i] = center_x * ahead[i] + right[i] / (2 * x);
    down[i] = center_y * ahead[i] - up[i] / (2 * y);
  }
  return {matrix_of({right, up, ahead, Point3d{0, 0, 0}}, {0, 0, 0, 1}, eye),
          matrix_of({across, down, ahead, ahead}, {0, 0, -1, 0}, eye)};
}

}  // namespace lightmill
