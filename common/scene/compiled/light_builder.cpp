#include "common/scene/compiled/light_builder.h"

#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "common/base/text.h"
#include "common/lights/photometry.h"
#include "common/materials/texel_values.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/validate/validate.h"

namespace lightmill {
namespace {

Vec3 unit(const Point3d& direction) {
  return Vec3(glm::normalize(near_one(to_vec(direction))));
}

/// 1 − cos of half the smallest angular diameter, 0.01°, that directions in single precision resolve.
constexpr double kMinDiskAngle = 4e-9;

/// The part of `up` across a unit direction, as a unit vector.
Vec3d across(const Vec3d& direction, const Point3d& up) {
  const Vec3d unit_up = glm::normalize(near_one(to_vec(up)));
  return glm::normalize(unit_up - direction * glm::dot(unit_up, direction));
}

double degrees_to_radians(double degrees) {
  return degrees * kPiDouble / 180;
}

/// 1 − cos of half this angular diameter. Disks that single precision does not resolve are none.
float disk_angle(double diameter_degrees) {
  const double angle = one_minus_cos_fixed(degrees_to_radians(diameter_degrees / 2));
  return angle < kMinDiskAngle ? 0.0f : static_cast<float>(angle);
}

/// The peak memory of an image that becomes an EnvironmentRadiance. First it is the texels with the radiance, then the
/// radiance with the weights of its pixels and their sums.
std::uint64_t peak_bytes(const Texels& texels) {
  const auto width = static_cast<std::uint64_t>(texels.width), height = static_cast<std::uint64_t>(texels.height);
  const std::uint64_t radiance = 3 * sizeof(float) * width * height;
  return radiance +
         std::max(size_bytes(texels), sizeof(double) * width * height + sizeof(float) * (width + 1) * height);
}

/// Linear RGB without negative values.
std::vector<float> linear_rgb(const Texels& texels) {
  const std::size_t pixels = static_cast<std::size_t>(texels.width) * static_cast<std::size_t>(texels.height);
  const bool floats = !texels.floats.empty();
  const std::span<const float> values = floats ? std::span<const float>() : texel_values(texels, texels.encoded);
  std::vector<float> out;
  out.reserve(3 * pixels);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      float value = floats ? texels.floats[4 * pixel + channel] : values[component(texels, pixel, channel)];
      value = std::max(value, 0.0f);
      out.push_back(floats && texels.encoded ? static_cast<float>(srgb_decode_fixed(std::min(value, 1.0f))) : value);
    }
  }
  return out;
}

}  // namespace

Vec3 LightBuilder::to_frame(const Point3d& p) const {
  return Vec3(frame_.to_frame(to_vec(p)));
}

/// Spheres whose projected area underflows in single precision are points.
float LightBuilder::sphere_radius(double radius) const {
  const auto in_frame = static_cast<float>(radius * frame_.scale());
  return in_frame * in_frame < std::numeric_limits<float>::min() ? 0.0f : in_frame;
}

void LightBuilder::note_group(LightKind kind, const std::string& group, bool hidden) {
  if (hidden) {
    hidden_.emplace_back(kind, groups_[kind].size());
  }
  groups_[kind].push_back(number_of_group(group_names_, group));
}

/// Reports a power that no surface can radiate. It would be lost silently.
Status LightBuilder::check_areas() const {
  for (const Object& object : scene_.objects) {
    const Material& material = scene_.materials[object.material];
    if (material.emission_unit == EmissionUnit::flux && !is_black(material.emission) &&
        !area_.contains(object.material)) {
      return invalid_argument(
          "materials[{}] \"{}\": a power needs a surface whose area is finite and above zero in single "
          "precision, but there is none",
          object.material, printable(material.name));
    }
  }
  return ok_status();
}

Status LightBuilder::add_lights(const CompiledScene::AssetSource& assets, const CompiledScene::ImageDecoder& images,
                                ImageBudget& budget, std::size_t max_ies_values) {
  LM_RETURN_IF_ERROR(check_areas());
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
    const Light& light = scene_.lights[i];
    const std::string where = fmt::format("lights[{}] \"{}\"", i, light.name);
    if (const auto* ies = std::get_if<IesLight>(&light.kind)) {
      LM_RETURN_IF_ERROR(add_ies(*ies, light.group, where, assets, max_ies_values));
    } else if (const auto* environment = std::get_if<EnvironmentLight>(&light.kind);
               environment != nullptr && environment->has_image) {
      LM_RETURN_IF_ERROR(add_image(*environment, light.group, where, assets, images, budget));
    } else {
      add_light(light);
    }
  }
  return ok_status();
}

/// Adds a light that needs no asset. Black lights are left out.
void LightBuilder::add_light(const Light& light) {
  std::visit(
      Overloaded{
          [&](const PointLight& point) {
            if (!is_black(point.intensity)) {
              lights_.points.add({to_frame(point.position), frame_.scaled_intensity(to_vec(point.intensity)),
                                  sphere_radius(point.radius)});
              note_group(LightKind::point, light.group, light.hidden_from_camera);
            }
          },
          [&](const DirectionalLight& sun) {
            if (!is_black(sun.irradiance)) {
              lights_.directional.add({unit(sun.direction), to_vec(sun.irradiance), disk_angle(sun.angle_degrees)});
              note_group(LightKind::directional, light.group, light.hidden_from_camera);
            }
          },
          [&](const SpotLight& spot) {
            if (!is_black(spot.intensity)) {
              const double outer = degrees_to_radians(spot.cutoff_degrees);
              lights_.spots.add({to_frame(spot.position), unit(spot.direction),
                                 frame_.scaled_intensity(to_vec(spot.intensity)),
                                 static_cast<float>(one_minus_cos_fixed(outer * (1 - spot.blend))),
                                 static_cast<float>(one_minus_cos_fixed(outer)), sphere_radius(spot.radius)});
              note_group(LightKind::spot, light.group, light.hidden_from_camera);
            }
          },
          [&](const CosinePowerLight& cosine_power) {
            if (!is_black(cosine_power.intensity)) {
              lights_.cosine_powers.add({to_frame(cosine_power.position), unit(cosine_power.direction),
                                         frame_.scaled_intensity(to_vec(cosine_power.intensity)),
                                         static_cast<float>(cosine_power.exponent)});
              note_group(LightKind::cosine_power, light.group);
            }
          },
          [&](const DiskLight& disk) { add_disk(disk, light); },
          [&](const IesLight&) {},
          [&](const EnvironmentLight& environment) {
            if (!is_black(environment.radiance)) {
              lights_.environment = EnvironmentRadiance(to_vec(environment.radiance));
              note_group(LightKind::environment, light.group);
            }
          },
      },
      light.kind);
}

/// Disks whose area underflows in single precision are left out.
void LightBuilder::add_disk(const DiskLight& disk, const Light& light) {
  const float radius = sphere_radius(disk.radius), second_radius = sphere_radius(disk.second_radius);
  if (is_black(disk.radiance) || radius == 0 || second_radius == 0) {
    return;
  }
  const Vec3d normal = glm::normalize(near_one(to_vec(disk.direction)));
  const Vec3d first = across(normal, disk.up);
  lights_.disks.add({to_frame(disk.position), Vec3(first * static_cast<double>(radius)),
                     Vec3(glm::cross(normal, first) * static_cast<double>(second_radius)), to_vec(disk.radiance),
                     degrees_to_radians(disk.spread_degrees), disk.rectangular});
  note_group(LightKind::disk, light.group, light.hidden_from_camera);
}

Status LightBuilder::add_image(const EnvironmentLight& light, const std::string& group, const std::string& where,
                               const CompiledScene::AssetSource& assets, const CompiledScene::ImageDecoder& images,
                               ImageBudget& budget) {
  LM_CHECK(images != nullptr, "{}: a decoder of images is needed", where);
  LM_ASSIGN_OR_RETURN(const std::string bytes, with_context(assets(light.asset), where));
  LM_ASSIGN_OR_RETURN(Texels texels, with_context(images(as_byte_view(bytes), light.file), where));
  const int width = texels.width, height = texels.height;
  LM_RETURN_IF_ERROR(
      with_context(check_environment_size(width, height, light.equal_area), fmt::format("{}: {}", where, light.file)));
  LM_RETURN_IF_ERROR(budget.take(peak_bytes(texels), where));
  if (!is_black(light.radiance)) {
    EnvironmentImage image;
    image.rgb = linear_rgb(texels);
    texels = {};
    image.width = static_cast<std::size_t>(width);
    image.height = static_cast<std::size_t>(height);
    image.mapping = light.equal_area ? EnvironmentMapping::equal_area : EnvironmentMapping::equirectangular;
    if (light.orientation) {
      const auto& [x, y, z] = *light.orientation;
      image.orientation = std::array{to_vec(x), to_vec(y), to_vec(z)};
    }
    image.rotation_degrees = light.rotation_degrees;
    lights_.environment = EnvironmentRadiance(std::move(image), to_vec(light.radiance));
    note_group(LightKind::environment, group);
  }
  return ok_status();
}

Status LightBuilder::add_ies(const IesLight& light, const std::string& group, const std::string& where,
                             const CompiledScene::AssetSource& assets, std::size_t max_values) {
  auto found = profiles_.find(light.asset);
  if (found == profiles_.end()) {
    LM_ASSIGN_OR_RETURN(const std::string bytes, with_context(assets(light.asset), where));
    LM_ASSIGN_OR_RETURN(const IesProfile profile, with_context(read_ies(bytes, light.file), where));
    if (profile.candela.size() > max_values - lights_.ies.values()) {
      return invalid_argument("{}: the scene's IES profiles have more than the limit of {} values", where, max_values);
    }
    found = profiles_.emplace(light.asset, lights_.ies.add_profile(profile)).first;
  }
  const Vec3d per_candela = with_luminance(Vec3d(to_vec(light.color)), radiometric(light.scale));
  if (per_candela == Vec3d(0)) {
    return ok_status();
  }
  const Vec3d direction = glm::normalize(near_one(to_vec(light.direction)));
  lights_.ies.add({to_frame(light.position), Vec3(direction), Vec3(across(direction, light.up)),
                   frame_.scaled_intensity(Vec3(per_candela)), found->second});
  note_group(LightKind::ies, group);
  return ok_status();
}

std::vector<Vec3> LightBuilder::radiance_of_materials() const {
  std::vector<Vec3> out;
  for (std::uint32_t i = 0; i < scene_.materials.size(); ++i) {
    const Material& material = scene_.materials[i];
    Vec3d radiance(to_vec(material.emission.rgb));
    if (material.emission_unit == EmissionUnit::flux) {
      const auto area = area_.find(i);
      const double sides = material.two_sided_emission ? 2 : 1;
      radiance = area == area_.end()
                     ? Vec3d(0)
                     : radiance / (exitance_per_radiance(material.emission_exponent) * area->second * sides);
    }
    constexpr double kLimit = 1e36;  // samples with this value are out of range anyway (SampleSums), but finite
    out.emplace_back(glm::min(radiance, Vec3d(kLimit)));
  }
  return out;
}

/// The emissive objects as points, by their final shapes and radiance.
EmitterPoints LightBuilder::emitter_points() const {
  EmitterPoints out;
  for (std::uint32_t i = 0; i < geometries_.size(); ++i) {
    const Geometry& geometry = geometries_[i];
    if (geometry.sphere && geometry.repeated) {
      continue;
    }
    if (geometry.sphere) {
      out.add(i, spheres_[geometry.primitives[0]].shape);
    } else if (geometry.first_facet < geometry.end_facet) {
      out.add(i, sums_of(geometry));
    }
  }
  return out;
}

LightBuilder::Tables LightBuilder::finish(const TextureSet& textures) {
  Tables out;
  out.radiance = radiance_of_materials();
  std::vector<std::uint32_t> group_of;  // light group of each material's emission
  for (const Material& material : scene_.materials) {
    group_of.push_back(number_of_group(group_names_, material.light_group));
  }
  const auto textured = [](const Facet& facet) { return facet.shape.texture.number != kNoTexture; };
  if (std::ranges::any_of(facets_, textured)) {
    lights_.facets.set_textures(textures);
  }
  // The radiance of a surface that rays meet, and the mean radiance of one that rays may pass.
  const auto mean_radiance = [&](std::uint32_t material) {
    return out.radiance[material] * static_cast<float>(uniform_opacity(scene_.materials[material].opacity).value_or(1));
  };
  for (Facet& facet : facets_) {
    facet.shape.radiance = mean_radiance(facet.material);
    lights_.facets.add(facet.shape);
    groups_[LightKind::facet].push_back(group_of[facet.material]);
  }
  for (Sphere& sphere : spheres_) {
    sphere.shape.radiance = mean_radiance(sphere.material);
    lights_.spheres.add(sphere.shape);
    groups_[LightKind::sphere].push_back(group_of[sphere.material]);
  }
  out.emitter_points = emitter_points();
  lights_.build(has_scattering_media(scene_));
  std::vector<std::uint32_t> groups;
  for (const auto& [kind, numbers] : groups_) {
    groups.insert(groups.end(), numbers.begin(), numbers.end());
  }
  if (lights_.environment.exists()) {  // the last light, if it is sampled
    out.environment_group = groups.back();
    groups.resize(lights_.size());
  }
  LM_CHECK(groups.size() == lights_.size(), "{} lights, {} groups", lights_.size(), groups.size());
  lights_.set_groups(std::move(groups));
  std::vector<std::uint8_t> hidden(hidden_.empty() ? 0 : lights_.size());
  for (const auto& [kind, index] : hidden_) {
    hidden[lights_.first(kind) + index] = 1;
  }
  lights_.set_hidden(std::move(hidden));
  for (Geometry& geometry : geometries_) {
    if (geometry.sphere) {
      geometry.primitives[0] += lights_.first(LightKind::sphere);
    }
    out.emitters.add_geometry(geometry.primitives);
  }
  out.lights = std::move(lights_);
  return out;
}

}  // namespace lightmill
