#include "common/scene/document.h"

#include <algorithm>
#include <set>

namespace lightmill {

std::vector<std::string> light_groups_of(const Scene& scene) {
  std::set<std::string> groups;
  for (const Material& material : scene.materials) {
    groups.insert(material.light_group);
  }
  for (const Light& light : scene.lights) {
    groups.insert(light.group);
  }
  groups.erase("");
  return {groups.begin(), groups.end()};
}

bool has_scattering_media(const Scene& scene) {
  return std::ranges::any_of(scene.objects, [&](const Object& object) {
    const Material& material = scene.materials[object.material];
    return is_boundary(material) && material.interior.scattering != RgbColor{};
  });
}

void remove_absorption(Scene& scene) {
  for (Material& material : scene.materials) {
    material.interior.absorption = {};
  }
}

}  // namespace lightmill
