#include "common/scene_io/missing_parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene_io/assets.h"
#include "common/scene_io/scene_bounds.h"
#include "common/scene_io/scene_light.h"
#include "common/scene_io/tiny_image.h"

namespace lightmill {
namespace {

Camera course_cornell_camera() {
  return {{277, 275, -570}, {277, 275, 0}, {0, 1, 0}, 2 * std::atan(0.5) * 180 / std::numbers::pi};
}

/// Whether the scene fills the box that was measured at Cornell, to 5 % of its size.
bool is_course_cornell_box(const Bounds& bounds) {
  const Vec3d size(556, 548.8, 559.2);
  const Vec3d off = glm::max(glm::abs(bounds.low), glm::abs(bounds.high - size)) / size;
  return std::max({off.x, off.y, off.z}) < 0.05;
}

}  // namespace

Camera camera_for(const Bounds& box) {
  constexpr double kFovDegrees = 40, kSineOfHalf = 0.3420201433256687;
  const Vec3d center = (box.low + box.high) / 2.0, half = box.size() / 2.0;
  const double radius = std::hypot(half.x, half.y, half.z);
  const Vec3d eye = center + (radius > 0 ? radius : 1) / kSineOfHalf * Vec3d(0.48, 0.36, 0.8);  // a unit vector
  return {{eye.x, eye.y, eye.z}, {center.x, center.y, center.z}, {0, 1, 0}, kFovDegrees};
}

Status use_automatic_camera(LoadedScene& loaded) {
  const Bounds bounds = bounds_of(loaded);
  if (bounds.empty()) {
    return invalid_argument("--camera auto: the scene has only planes, which are infinite: give a camera");
  }
  loaded.scene.camera = camera_for(bounds);
  return ok_status();
}

void add_uniform_sky(LoadedScene& loaded) {
  loaded.scene.lights.push_back({"sky", EnvironmentLight{}});
}

void add_soft_sky(LoadedScene& loaded) {
  constexpr int kWidth = 32, kHeight = 16;
  const Vec3d brightest = glm::normalize(Vec3d(-0.25, 0.85, 0.5));
  std::vector<RgbColor> texels;
  for (int row = 0; row < kHeight; ++row) {
    const double theta = (row + 0.5) / kHeight * std::numbers::pi;
    for (int column = 0; column < kWidth; ++column) {
      const double phi = ((column + 0.5) / kWidth - 0.5) * 2 * std::numbers::pi;
      const Vec3d w(std::cos(phi) * std::sin(theta), std::cos(theta), std::sin(phi) * std::sin(theta));
      const auto radiance = static_cast<float>(0.6 + 0.6 * glm::dot(w, brightest));
      texels.push_back({radiance, radiance, radiance});
    }
  }
  TinyImage image = tiny_image(kWidth, kHeight, texels);
  EnvironmentLight sky;
  sky.radiance = {image.factor, image.factor, image.factor};
  sky.asset = add_image(std::move(image.bytes), {.name = "sky", .place = "the sky"}, loaded);
  sky.has_image = true;
  loaded.scene.lights.push_back({"sky", std::move(sky)});
}

void add_missing_camera(LoadedScene& loaded) {
  const Bounds bounds = bounds_of(loaded);
  if (is_course_cornell_box(bounds)) {
    loaded.scene.camera = course_cornell_camera();
  } else {
    loaded.notices.emplace_back(kCameraWasAdded);
    loaded.scene.camera = camera_for(bounds);
  }
}

void add_missing_light(LoadedScene& loaded) {
  if (!emits_light(loaded.scene)) {
    loaded.notices.emplace_back("nothing emits light: a soft sky was added (--sky off leaves it out)");
  } else if (!is_course_cornell_box(bounds_of(loaded)) && !is_lit(loaded)) {
    loaded.notices.emplace_back(
        "the emissive surfaces do not light the others: a soft sky was added (--sky off leaves it out)");
  } else {
    return;
  }
  add_soft_sky(loaded);
}

}  // namespace lightmill
