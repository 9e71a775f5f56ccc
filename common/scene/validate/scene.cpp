#include "common/scene/validate/parts.h"

#include <algorithm>

#include "common/base/text.h"
#include "common/film/layers.h"

namespace lightmill {
namespace {

/// An infinite plane cannot share a power.
Status check_planes(const Scene& scene) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Material& material = scene.materials[object.material];
    if (std::holds_alternative<PlaneShape>(object.shape) && material.emission_unit == EmissionUnit::flux &&
        material.emission != TexturedColor{}) {
      return invalid_argument(
          "objects[{}].plane: its material \"{}\" states a power (materials[{}].emission_flux, or emission_strength in watt "
          "or lumen), which an infinite plane cannot have: give radiance or watts per square metre",
          i, printable(material.name), object.material);
    }
  }
  return ok_status();
}

/// Shadow catchers compare light with and without shadows. Light without shadows is known only for lights that are
/// sampled. Its formula holds only for Lambertian ones.
Status check_shadow_catchers(const Scene& scene) {
  const auto catcher = std::ranges::find_if(scene.objects, [&](const Object& object) {
    return std::holds_alternative<ShadowCatcherMaterial>(scene.materials[object.material].kind);
  });
  if (catcher == scene.objects.end()) {
    return ok_status();
  }
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const auto* const disk = std::get_if<DiskLight>(&scene.lights[i].kind);
    if (disk != nullptr && disk->spread_degrees != 180) {
      return invalid_argument(
          "lights[{}].{}.spread_degrees: must be 180 in a scene with a shadow catcher (objects[{}]), got {}", i,
          disk->kind_name(), catcher - scene.objects.begin(), disk->spread_degrees);
    }
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Material& material = scene.materials[object.material];
    if (material.emission == TexturedColor{}) {
      continue;
    }
    const auto refused = [&](std::string_view field, std::string_view what) {
      return invalid_argument(
          "materials[{}]{}: \"{}\", of objects[{}], emits {}, which is not possible in a scene with a shadow catcher "
          "(objects[{}])",
          object.material, field, printable(material.name), i, what, catcher - scene.objects.begin());
    };
    if (material.emission.texture != kNoTexture) {
      return refused(".emission", "with a texture");
    }
    if (material.emission_exponent != 0) {
      return refused(".emission_exponent", "with an exponent");
    }
    if (std::holds_alternative<PlaneShape>(object.shape)) {
      return refused(".emission", "on a plane");
    }
  }
  return ok_status();
}

Status check_counts(const Scene& scene) {
  const auto within = [](std::string_view path, std::size_t count) {
    return count <= kMaxSceneEntries
               ? ok_status()
               : invalid_argument("{}: at most {} are possible, got {}", path, kMaxSceneEntries, count);
  };
  LM_RETURN_IF_ERROR(within("textures", scene.textures.size()));
  LM_RETURN_IF_ERROR(within("materials", scene.materials.size()));
  LM_RETURN_IF_ERROR(within("objects", scene.objects.size()));
  const auto media =
      static_cast<std::size_t>(std::count_if(scene.materials.begin(), scene.materials.end(), is_boundary));
  if (media > kMaxMedia) {
    return invalid_argument("materials: at most {} may be dielectric or transmit, got {}", kMaxMedia, media);
  }
  LM_RETURN_IF_ERROR(within("lights", scene.lights.size()));
  if (scene.objects.empty()) {
    return invalid_argument("objects: the scene is empty, at least one object is expected");
  }
  return ok_status();
}

}  // namespace

Status validate(const Scene& scene) {
  LM_RETURN_IF_ERROR(validate(scene.camera));
  LM_RETURN_IF_ERROR(check_film(scene.film));
  LM_RETURN_IF_ERROR(check_counts(scene));
  LM_RETURN_IF_ERROR(check_name_length("scene", scene.name));
  std::set<std::string_view> textures, materials;
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    LM_RETURN_IF_ERROR(check_texture(fmt::format("textures[{}]", i), scene.textures[i]));
    LM_RETURN_IF_ERROR(check_name_length(fmt::format("textures[{}]", i), scene.textures[i].name));
    LM_RETURN_IF_ERROR(check_new_name(textures, fmt::format("textures[{}]", i), scene.textures[i].name, "texture"));
  }
  LM_RETURN_IF_ERROR(check_tiles(scene.textures));
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    LM_RETURN_IF_ERROR(check_material(fmt::format("materials[{}]", i), scene.materials[i]));
    LM_RETURN_IF_ERROR(check_name_length(fmt::format("materials[{}]", i), scene.materials[i].name));
    LM_RETURN_IF_ERROR(check_new_name(materials, fmt::format("materials[{}]", i), scene.materials[i].name, "material"));
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const std::string path = fmt::format("objects[{}]", i);
    LM_RETURN_IF_ERROR(check_name_length(path, scene.objects[i].name));
    LM_RETURN_IF_ERROR(check_object(path, scene.objects[i], scene.materials.size()));
  }
  LM_RETURN_IF_ERROR(check_lights(scene.lights));
  LM_RETURN_IF_ERROR(check_planes(scene));
  LM_RETURN_IF_ERROR(check_shadow_catchers(scene));
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    LM_RETURN_IF_ERROR(check_name_length(fmt::format("lights[{}]", i), scene.lights[i].name));
    LM_RETURN_IF_ERROR(check_group(fmt::format("lights[{}].group", i), scene.lights[i].group));
  }
  if (const std::size_t groups = light_groups_of(scene).size(); groups > kMaxSceneLightGroups) {
    return invalid_argument("lights: at most {} light groups are possible, got {}", kMaxSceneLightGroups, groups);
  }
  return check_meters(scene.meters);
}

}  // namespace lightmill
