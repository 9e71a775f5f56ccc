#include "common/scene_io/missing_parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene_io/scene_bounds.h"
#include "common/scene_io/scene_light.h"

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

void add_sky(LoadedScene& loaded) {
  loaded.scene.lights.push_back({"sky", EnvironmentLight{}});
}

void add_missing_camera(LoadedScene& loaded) {
  const Bounds bounds = bounds_of(loaded);
  if (is_course_cornell_box(bounds)) {
    loaded.scene.camera = course_cornell_camera();
  } else {
    loaded.notices.emplace_back(
        "there is no camera: one was added that sees all from the front, above and right (--camera chooses another)");
    loaded.scene.camera = camera_for(bounds);
  }
}

void add_missing_light(LoadedScene& loaded) {
  if (!emits_light(loaded.scene)) {
    loaded.notices.emplace_back("nothing emits light: a uniform white sky was added (--sky off leaves it out)");
  } else if (!is_course_cornell_box(bounds_of(loaded)) && !is_lit(loaded)) {
    loaded.notices.emplace_back(
        "the emissive surfaces do not light the others: a uniform white sky was added (--sky off leaves it out)");
  } else {
    return;
  }
  add_sky(loaded);
}

}  // namespace lightmill
