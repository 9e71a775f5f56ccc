#include "tests/atlas/cases/atlas_case.h"

#include <fmt/format.h>

#include <cmath>

#include "common/math/transcendental.h"
#include "tests/support/paths.h"

namespace lightmill::test {

std::string AtlasView::text() const {
  return fmt::format(R"("eye": [{:.17g}, {:.17g}, {:.17g}], "look_at": [{:.17g}, {:.17g}, {:.17g}])", eye.x, eye.y,
                     eye.z, look_at.x, look_at.y, look_at.z);
}

double AtlasView::mean_of(const std::function<double(const Vec3d&)>& radiance, int steps) const {
  const Vec3d forward = glm::normalize(look_at - eye);
  const Vec3d right = glm::normalize(glm::cross(forward, Vec3d(0, 1, 0))), up = glm::cross(right, forward);
  const double half = std::tan(fov_degrees * kPiDouble / 360);
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double a = half * (2 * (i + 0.5) / steps - 1), b = half * (2 * (j + 0.5) / steps - 1);
      sum += radiance(forward + right * a + up * b);
    }
  }
  return sum / steps / steps;
}

TestScene scene_of(const AtlasCase& what, const CompiledScene::ImageDecoder& images) {
  constexpr int kFileSize = 64;  ///< pixels on a side of the files in scenes/
  return what.document.ends_with(".json")
             ? TestScene(source_file("scenes/" + what.document), images).resized(kFileSize, kFileSize)
             : TestScene::from_text(what.document, what.files, images);
}

std::span<const AtlasGroup> atlas_groups() {
  static constexpr AtlasGroup kGroups[] = {
      {"Caustics", caustic_cases}, {"Shrinking", shrinking_cases},  {"Faces", face_cases},   {"Places", place_cases},
      {"Glass", glass_cases},      {"Materials", material_cases},   {"Lights", light_cases}, {"Media", media_cases},
      {"Pictures", picture_cases}, {"SceneFiles", scene_file_cases}};
  return kGroups;
}

}  // namespace lightmill::test
