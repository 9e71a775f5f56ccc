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

std::vector<Sha256> assets_of(const Scene& scene) {
  std::set<Sha256> assets;
  for (const TextureImage& texture : scene.textures) {
    assets.insert(texture.asset);
  }
  for (const Object& object : scene.objects) {
    if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
      assets.insert(mesh->asset);
    }
  }
  for (const Light& light : scene.lights) {
    if (const auto* ies = std::get_if<IesLight>(&light.kind)) {
      assets.insert(ies->asset);
    } else if (const auto* environment = std::get_if<EnvironmentLight>(&light.kind);
               environment != nullptr && environment->has_image) {
      assets.insert(environment->asset);
    }
  }
  return {assets.begin(), assets.end()};
}

}  // namespace lightmill
