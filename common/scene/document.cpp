#include "common/scene/document.h"

#include <cmath>
#include <set>

#include "common/base/text.h"
#include "common/film/layers.h"
#include "common/film/tile_grid.h"
#include "common/scene/checks.h"
#include "common/scene/meter_checks.h"

namespace lightmill {
namespace {

Status check_film(const FilmSettings& film) {
  if (film.width < 1 || film.width > kMaxFilmSide) {
    return invalid_argument("film.width: must be 1 to {}, got {}", kMaxFilmSide, film.width);
  }
  if (film.height < 1 || film.height > kMaxFilmSide) {
    return invalid_argument("film.height: must be 1 to {}, got {}", kMaxFilmSide, film.height);
  }
  if (!(film.filter.radius_pixels > 0 && film.filter.radius_pixels <= kMaxFilterRadius)) {
    return invalid_argument("film.filter.radius_pixels: must be in (0, {}], got {}", kMaxFilterRadius,
                            film.filter.radius_pixels);
  }
  return ok_status();
}

Status check_group(const std::string& path, const std::string& group) {
  return group.empty() || is_light_group_name(group)
             ? ok_status()
             : invalid_argument(
                   "{}: at most {} letters, digits, '-' and '_' are possible, and not \"rest\"; got \"{}\"", path,
                   kMaxLightGroupName, printable(group));
}

Status check_material(const std::string& path, const Material& material) {
  if (material.name.empty()) {
    return invalid_argument("{}.name: must not be empty", path);
  }
  LM_RETURN_IF_ERROR(check_material_kind(path, material));
  LM_RETURN_IF_ERROR(check_exponent(path + ".emission_exponent", material.emission_exponent));
  if (material.emission_unit == EmissionUnit::flux && material.emission.texture != kNoTexture) {
    return invalid_argument("{}.emission_flux: cannot vary by a texture", path);
  }
  LM_RETURN_IF_ERROR(check_group(path + ".light_group", material.light_group));
  return check_power(path + ".emission", material.emission.rgb);
}

/// Columns of the linear part must span space, and of a sphere be orthogonal and of one length.
Status check_transform(const std::string& path, const Object& object) {
  const Transform& t = object.transform;
  for (const auto& row : t) {
    for (const double value : row) {
      if (!(std::abs(value) <= kMaxCoordinate)) {
        return invalid_argument("{}: numbers must be finite and at most {}, got {}", path, kMaxCoordinate, value);
      }
    }
  }
  if (!spans_space(t)) {
    return invalid_argument("{}: the map is not invertible (a scale of zero, or axes in one plane)", path);
  }
  const double length = std::hypot(t[0][0], t[1][0], t[2][0]);
  const auto column = [&](std::size_t i) { return Point3d{t[0][i] / length, t[1][i] / length, t[2][i] / length}; };
  const auto dot = [](const Point3d& a, const Point3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const Point3d x = column(0), y = column(1), z = column(2);
  const double length2 = dot(x, x);
  const bool similar = std::abs(dot(y, y) - length2) <= 1e-9 * length2 &&
                       std::abs(dot(z, z) - length2) <= 1e-9 * length2 && std::abs(dot(x, y)) <= 1e-9 * length2 &&
                       std::abs(dot(y, z)) <= 1e-9 * length2 && std::abs(dot(z, x)) <= 1e-9 * length2;
  if (std::holds_alternative<SphereShape>(object.shape) && !similar) {
    return invalid_argument("{}: a sphere can be moved, rotated and scaled equally along all axes, not be distorted",
                            path);
  }
  return ok_status();
}

Status check_texture(const std::string& path, const TextureImage& texture) {
  if (texture.name.empty()) {
    return invalid_argument("{}.name: must not be empty", path);
  }
  constexpr double kLimit = 1e6;
  for (const auto& [field, pair] : {std::pair{"scale", texture.scale}, {"offset", texture.offset}}) {
    for (const double value : pair) {
      if (!(std::abs(value) <= kLimit)) {
        return invalid_argument("{}.{}: must be finite and at most {}, got ({}, {})", path, field, kLimit, pair[0],
                                pair[1]);
      }
    }
  }
  return ok_status();
}

Status check_object(const std::string& path, const Object& object, std::size_t materials) {
  if (object.material >= materials) {
    return invalid_argument("{}.material: index {} is out of range, there are {} materials", path, object.material,
                            materials);
  }
  if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
    LM_RETURN_IF_ERROR(check_point(path + ".sphere.center", sphere->center));
    if (!(sphere->radius > 0 && sphere->radius <= kMaxCoordinate)) {
      return invalid_argument("{}.sphere.radius: must be positive and at most {}, got {}", path, kMaxCoordinate,
                              sphere->radius);
    }
  } else if (const auto* plane = std::get_if<PlaneShape>(&object.shape)) {
    LM_RETURN_IF_ERROR(check_point(path + ".plane.point", plane->point));
    LM_RETURN_IF_ERROR(check_point(path + ".plane.normal", plane->normal));
    if (!(std::hypot(plane->normal[0], plane->normal[1], plane->normal[2]) > 0)) {
      return invalid_argument("{}.plane.normal: must not be zero", path);
    }
  } else if (const auto* triangle = std::get_if<TriangleShape>(&object.shape)) {
    LM_RETURN_IF_ERROR(check_point(path + ".triangle.a", triangle->a));
    LM_RETURN_IF_ERROR(check_point(path + ".triangle.b", triangle->b));
    LM_RETURN_IF_ERROR(check_point(path + ".triangle.c", triangle->c));
  }
  return check_transform(path + ".transform", object);
}

/// What is without end cannot share a flux.
Status check_planes(const Scene& scene) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Material& material = scene.materials[object.material];
    if (std::holds_alternative<PlaneShape>(object.shape) && material.emission_unit == EmissionUnit::flux &&
        material.emission != TexturedColor{}) {
      return invalid_argument(
          "objects[{}].plane: its material \"{}\" states a flux (materials[{}].emission_flux, or a strength in watt or "
          "lumen), which a plane without end cannot have; state radiance or watts per square metre",
          i, printable(material.name), object.material);
    }
  }
  return ok_status();
}

/// Holdouts compare light with shadows to light without; the latter is known only of lights that are sampled, and by a
/// formula only of those that are Lambertian.
Status check_holdouts(const Scene& scene) {
  const auto holdout = std::ranges::find_if(scene.objects, [&](const Object& object) {
    return std::holds_alternative<HoldoutMaterial>(scene.materials[object.material].kind);
  });
  if (holdout == scene.objects.end()) {
    return ok_status();
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Material& material = scene.materials[object.material];
    if (material.emission == TexturedColor{}) {
      continue;
    }
    const auto refused = [&](std::string_view field, std::string_view what) {
      return invalid_argument(
          "materials[{}]{}: \"{}\", of objects[{}], emits {}, which has no place in a scene with a holdout "
          "(objects[{}])",
          object.material, field, printable(material.name), i, what, holdout - scene.objects.begin());
    };
    if (material.emission.texture != kNoTexture) {
      return refused(".emission", "by a texture");
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

Status validate(const Camera& camera) {
  LM_RETURN_IF_ERROR(check_point("camera.eye", camera.eye));
  LM_RETURN_IF_ERROR(check_point("camera.look_at", camera.look_at));
  LM_RETURN_IF_ERROR(check_point("camera.up", camera.up));
  if (!(camera.vertical_fov_degrees > 0 && camera.vertical_fov_degrees < 180)) {
    return invalid_argument("camera.vertical_fov_degrees: must be in (0, 180), got {}", camera.vertical_fov_degrees);
  }
  for (const auto& [field, value] :
       {std::pair{"lens_radius", camera.lens_radius}, {"focus_distance", camera.focus_distance}}) {
    if (!(value >= 0 && value <= kMaxCoordinate)) {
      return invalid_argument("camera.{}: must be from 0 to {}, got {}", field, kMaxCoordinate, value);
    }
  }
  const Point3d d{camera.look_at[0] - camera.eye[0], camera.look_at[1] - camera.eye[1],
                  camera.look_at[2] - camera.eye[2]};
  const Point3d& u = camera.up;
  const double view_length = std::hypot(d[0], d[1], d[2]);
  const double up_length = std::hypot(u[0], u[1], u[2]);
  if (!(view_length > 0)) {
    return invalid_argument("camera.look_at: must differ from camera.eye, both are ({}, {}, {})", camera.eye[0],
                            camera.eye[1], camera.eye[2]);
  }
  if (!(up_length > 0)) {
    return invalid_argument("camera.up: must not be zero");
  }
  const double sine = std::hypot(d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0]) /
                      (view_length * up_length);
  if (!(sine > 1e-6)) {
    return invalid_argument("camera.up: must not be parallel to the direction from eye to look_at, got ({}, {}, {})",
                            u[0], u[1], u[2]);
  }
  return ok_status();
}

Status validate(const Scene& scene) {
  LM_RETURN_IF_ERROR(validate(scene.camera));
  LM_RETURN_IF_ERROR(check_film(scene.film));
  LM_RETURN_IF_ERROR(check_counts(scene));
  std::set<std::string_view> textures;
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    LM_RETURN_IF_ERROR(check_texture(fmt::format("textures[{}]", i), scene.textures[i]));
    if (!textures.insert(scene.textures[i].name).second) {
      return invalid_argument("textures[{}].name: \"{}\" names an earlier texture already", i, scene.textures[i].name);
    }
  }
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    LM_RETURN_IF_ERROR(check_material(fmt::format("materials[{}]", i), scene.materials[i]));
    if (!names.insert(scene.materials[i].name).second) {
      return invalid_argument("materials[{}].name: \"{}\" names an earlier material already", i,
                              scene.materials[i].name);
    }
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    LM_RETURN_IF_ERROR(check_object(fmt::format("objects[{}]", i), scene.objects[i], scene.materials.size()));
  }
  LM_RETURN_IF_ERROR(check_lights(scene.lights));
  LM_RETURN_IF_ERROR(check_planes(scene));
  LM_RETURN_IF_ERROR(check_holdouts(scene));
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    LM_RETURN_IF_ERROR(check_group(fmt::format("lights[{}].group", i), scene.lights[i].group));
  }
  if (const std::size_t groups = light_groups_of(scene).size(); groups > kMaxSceneLightGroups) {
    return invalid_argument("lights: at most {} light groups are possible, got {}", kMaxSceneLightGroups, groups);
  }
  return validate_meters(scene.meters);
}

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

std::string describe_unknown_material(std::string_view name, const std::vector<Material>& materials) {
  std::string text = fmt::format("unknown material \"{}\"; ", name);
  if (materials.empty()) {
    return text + "there are none";
  }
  text += "the materials are ";
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 0; i < std::min(materials.size(), kShown); ++i) {
    text += (i > 0 ? ", " : "") + materials[i].name;
  }
  if (materials.size() > kShown) {
    text += fmt::format(" and {} more", materials.size() - kShown);
  }
  return text;
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
