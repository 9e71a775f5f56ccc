#include "common/scene/compiled/light_builder.h"

#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "common/base/text.h"
#include "common/lights/photometry.h"
#include "common/materials/texture.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/facet_texture.h"
#include "common/scene/compiled/mesh_parts.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/validate/validate.h"

namespace lightmill {
namespace {

Vec3 unit(const Point3d& direction) {
  return Vec3(glm::normalize(near_one(to_vec(direction))));
}

double degrees_to_radians(double degrees) {
  return degrees * kPiDouble / 180;
}

/// The most that is held of an image on its way to an EnvironmentRadiance: its texels with the radiance, then the
/// radiance with the weights of its pixels and with their sums.
std::uint64_t peak_bytes(const Texels& texels) {
  const auto width = static_cast<std::uint64_t>(texels.width), height = static_cast<std::uint64_t>(texels.height);
  const std::uint64_t radiance = 3 * sizeof(float) * width * height;
  return radiance +
         std::max(size_bytes(texels), sizeof(double) * width * height + sizeof(float) * (width + 1) * height);
}

/// Linear RGB without negative values.
std::vector<float> linear_rgb(const Texels& texels) {
  const std::size_t pixels = static_cast<std::size_t>(texels.width) * static_cast<std::size_t>(texels.height);
  std::array<float, 256> of_byte{};
  for (std::size_t i = 0; i < of_byte.size(); ++i) {
    const double value = static_cast<double>(i) / 255;
    of_byte[i] = static_cast<float>(texels.encoded ? srgb_decode_fixed(value) : value);
  }
  std::vector<float> out;
  out.reserve(3 * pixels);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      float value = 0;
      if (texels.floats.empty()) {
        value = of_byte[texels.bytes[pixel] >> (8 * channel) & 255];
      } else {
        value = std::max(texels.floats[4 * pixel + channel], 0.0f);
        value = texels.encoded ? static_cast<float>(srgb_decode_fixed(std::min(value, 1.0f))) : value;
      }
      out.push_back(value);
    }
  }
  return out;
}

/// The same for outlines with the same corners in the same sense, or in either: beginning with the smallest. Three
/// corners end with the first one again.
std::array<float, 12> canonical(std::vector<Vec3> outline, bool either_sense) {
  const auto less = [](const Vec3& a, const Vec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
  std::rotate(outline.begin(), std::min_element(outline.begin(), outline.end(), less), outline.end());
  if (either_sense && less(outline.back(), outline[1])) {
    std::reverse(outline.begin() + 1, outline.end());
  }
  outline.resize(4, outline.front());
  std::array<float, 12> out{};
  for (std::size_t i = 0; i < 4; ++i) {
    std::copy_n(&outline[i].x, 3, out.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  return out;
}

}  // namespace

Vec3 LightBuilder::to_frame(const Point3d& p) const {
  return Vec3(frame_.to_frame(to_vec(p)));
}

void LightBuilder::note_group(LightKind kind, const std::string& group) {
  groups_[kind].push_back(number_of_group(group_names_, group));
}

void LightBuilder::add_other() {
  geometries_.emplace_back();
}

void LightBuilder::add_sphere(std::uint32_t material, const Vec3& center, float radius, bool inward, bool sampled) {
  Geometry& geometry = geometries_.emplace_back();
  // One whose area is no number in single precision cannot be hit.
  if (!sampled || radius * radius < std::numeric_limits<float>::min()) {
    return;
  }
  const Material& m = scene_.materials[material];
  Place& place = sphere_places_[{center.x, center.y, center.z, radius, inward && !m.two_sided_emission}];
  const double scene_radius = radius / frame_.scale();
  const bool added = stand_at(place, spheres_.size(), material, 4 * kPiDouble * scene_radius * scene_radius);
  geometry.sphere = true;
  geometry.repeated = !added;
  geometry.primitives.push_back(place.number);
  if (added) {
    spheres_.push_back(
        {material, {center, radius, Vec3(0), inward, m.two_sided_emission, static_cast<float>(m.emission_exponent)}});
  }
}

/// Whether it is the first one there, and therefore the light of this number.
bool LightBuilder::stand_at(Place& place, std::size_t number, std::uint32_t material, double area) {
  const bool first = place.materials.empty();
  if (first) {
    place.number = static_cast<std::uint32_t>(number);
  }
  if (std::ranges::find(place.materials, material) == place.materials.end()) {
    place.materials.push_back(material);
    area_[material] += area;
  }
  return first;
}

void LightBuilder::add_mesh(std::uint32_t material, const std::vector<std::array<float, 3>>& positions,
                            const Mesh& mesh, bool sampled) {
  Geometry& geometry = geometries_.emplace_back();
  if (!sampled) {
    return;
  }
  geometry.first_facet = facets_.size();
  const Material& m = scene_.materials[material];
  const MeshParts parts = m.two_sided_emission ? find_parts(positions, mesh.triangles) : MeshParts();
  const auto& triangles = mesh.triangles;
  const auto corner = [&](std::uint32_t i) { return Vec3(positions[i][0], positions[i][1], positions[i][2]); };
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = triangles[i];
    EmissiveFacet facet{corner(t[0]),
                        corner(t[1]) - corner(t[0]),
                        corner(t[2]) - corner(t[0]),
                        Vec3(0),
                        m.two_sided_emission,
                        false,
                        static_cast<float>(m.emission_exponent)};
    if (m.two_sided_emission) {
      facet.part = static_cast<std::uint32_t>(closed_parts_.size()) + parts.of_triangle[i];
      facet.flipped = parts.flipped[i];
    }
    facet.texture = facet_texture(m, mesh, t);
    std::vector<Vec3> outline{facet.corner, corner(t[1]), corner(t[2])};
    // Two triangles in a row that are the halves (0, 1, 2) and (0, 2, 3) of a parallelogram.
    if (i + 1 < triangles.size() && triangles[i + 1][0] == t[0] && triangles[i + 1][1] == t[2]) {
      const Vec3 edge3 = corner(triangles[i + 1][2]) - facet.corner;
      const FacetTexture whole = facet_texture(m, mesh, {t[0], t[1], triangles[i + 1][2]});
      if (glm::length(facet.edge2 - facet.edge1 - edge3) <= 1e-6f * glm::length(facet.edge2) &&
          fits_parallelogram(whole, mesh, t[2])) {
        facet.edge2 = edge3;
        facet.texture = whole;
        facet.parallelogram = true;
        outline.push_back(corner(triangles[i + 1][2]));
        ++i;
      }
    }
    // A facet without area cannot be hit: its primitives may name the next one, or none.
    auto number = static_cast<std::uint32_t>(facets_.size());
    if (glm::length(glm::cross(facet.edge1, facet.edge2)) > 0) {
      const double area = (facet.parallelogram ? 1 : 0.5) *
                          glm::length(glm::cross(Vec3d(facet.edge1), Vec3d(facet.edge2))) /
                          (frame_.scale() * frame_.scale());
      Place& place = facet_places_[canonical(outline, m.two_sided_emission)];
      if (stand_at(place, facets_.size(), material, area)) {
        facets_.push_back({material, facet});
      }
      number = place.number;
    }
    geometry.primitives.insert(geometry.primitives.end(), outline.size() - 2, number);
  }
  geometry.end_facet = facets_.size();
  closed_parts_.insert(closed_parts_.end(), parts.closed.begin(), parts.closed.end());
}

FacetSums LightBuilder::sums_of(const Geometry& geometry) const {
  FacetSums sums;
  for (std::size_t i = geometry.first_facet; i < geometry.end_facet; ++i) {
    EmissiveFacet facet = facets_[i].shape;
    facet.radiance = Vec3(lights_.facets.mean_radiance(i));
    sums.add(facet, facet.part != EmissiveFacet::kAlone && closed_parts_[facet.part]);
  }
  return sums;
}

/// A power that nothing can radiate would be lost without a word.
Status LightBuilder::check_areas() const {
  for (const Object& object : scene_.objects) {
    const Material& material = scene_.materials[object.material];
    if (material.emission_unit == EmissionUnit::flux && !is_black(material.emission) &&
        !area_.contains(object.material)) {
      return invalid_argument(
          "materials[{}] \"{}\": a power needs a surface to radiate it, of an area that is neither without end nor "
          "zero "
          "in single precision; there is none",
          object.material, printable(material.name));
    }
  }
  return ok_status();
}

Status LightBuilder::add_lights(const AssetSource& assets, const ImageDecoder& images, ImageBudget& budget,
                                std::size_t max_ies_values) {
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

/// Lights that need no asset. Black ones are left out.
void LightBuilder::add_light(const Light& light) {
  std::visit(Overloaded{
                 [&](const PointLight& point) {
                   if (!is_black(point.intensity)) {
                     lights_.points.add({to_frame(point.position), frame_.scaled_intensity(to_vec(point.intensity))});
                     note_group(LightKind::point, light.group);
                   }
                 },
                 [&](const DirectionalLight& sun) {
                   if (!is_black(sun.irradiance)) {
                     lights_.directional.add({unit(sun.direction), to_vec(sun.irradiance)});
                     note_group(LightKind::directional, light.group);
                   }
                 },
                 [&](const SpotLight& spot) {
                   if (!is_black(spot.intensity)) {
                     const double outer = degrees_to_radians(spot.cutoff_degrees);
                     lights_.spots.add({to_frame(spot.position), unit(spot.direction),
                                        frame_.scaled_intensity(to_vec(spot.intensity)),
                                        static_cast<float>(one_minus_cos_fixed(outer * (1 - spot.blend))),
                                        static_cast<float>(one_minus_cos_fixed(outer))});
                     note_group(LightKind::spot, light.group);
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

Status LightBuilder::add_image(const EnvironmentLight& light, const std::string& group, const std::string& where,
                               const AssetSource& assets, const ImageDecoder& images, ImageBudget& budget) {
  LM_CHECK(images != nullptr, "{}: a decoder of images is needed", where);
  const Result<std::string> bytes = assets(light.asset);
  if (!bytes.ok()) {
    return with_context(bytes.status(), where);
  }
  Result<Texels> texels = images(as_byte_view(*bytes), light.file);
  if (!texels.ok()) {
    return with_context(texels.status(), where);
  }
  const int width = texels->width, height = texels->height;
  if (const Status size = check_environment_size(width, height); !size.ok()) {
    return with_context(size, fmt::format("{}: {}", where, light.file));
  }
  LM_RETURN_IF_ERROR(budget.take(peak_bytes(*texels), where));
  if (!is_black(light.radiance)) {
    std::vector<float> rgb = linear_rgb(*texels);
    *texels = {};
    lights_.environment =
        EnvironmentRadiance(std::move(rgb), static_cast<std::size_t>(width), static_cast<std::size_t>(height),
                            to_vec(light.radiance), light.rotation_degrees);
    note_group(LightKind::environment, group);
  }
  return ok_status();
}

Status LightBuilder::add_ies(const IesLight& light, const std::string& group, const std::string& where,
                             const AssetSource& assets, std::size_t max_values) {
  auto found = profiles_.find(light.asset);
  if (found == profiles_.end()) {
    const Result<std::string> bytes = assets(light.asset);
    if (!bytes.ok()) {
      return with_context(bytes.status(), where);
    }
    const Result<IesProfile> profile = read_ies(*bytes, light.file);
    if (!profile.ok()) {
      return with_context(profile.status(), where);
    }
    if (profile->candela.size() > max_values - lights_.ies.values()) {
      return invalid_argument("{}: the scene's IES profiles have more than the limit of {} values", where, max_values);
    }
    found = profiles_.emplace(light.asset, lights_.ies.add_profile(*profile)).first;
  }
  const Vec3d per_candela = with_luminance(Vec3d(to_vec(light.color)), radiometric(light.scale));
  if (per_candela == Vec3d(0)) {
    return ok_status();
  }
  const Vec3d direction = glm::normalize(near_one(to_vec(light.direction)));
  const Vec3d up = glm::normalize(near_one(to_vec(light.up)));
  lights_.ies.add({to_frame(light.position), Vec3(direction),
                   Vec3(glm::normalize(up - direction * glm::dot(up, direction))),
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
    constexpr double kLimit = 1e36;  // a sample that sees this is out of range anyway (SampleSums), but finite
    out.emplace_back(glm::min(radiance, Vec3d(kLimit)));
  }
  return out;
}

/// Of the shapes as they are in the end, with their radiance.
HardLights LightBuilder::hard_lights() const {
  HardLights out;
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
  std::vector<std::uint32_t> group_of;  // of each material's emission
  for (const Material& material : scene_.materials) {
    group_of.push_back(number_of_group(group_names_, material.light_group));
  }
  const auto textured = [](const Facet& facet) { return facet.shape.texture.number != kNoTexture; };
  if (std::ranges::any_of(facets_, textured)) {
    lights_.facets.set_textures(textures);
  }
  for (Facet& facet : facets_) {
    facet.shape.radiance = out.radiance[facet.material];
    lights_.facets.add(facet.shape);
    groups_[LightKind::facet].push_back(group_of[facet.material]);
  }
  for (Sphere& sphere : spheres_) {
    sphere.shape.radiance = out.radiance[sphere.material];
    lights_.spheres.add(sphere.shape);
    groups_[LightKind::sphere].push_back(group_of[sphere.material]);
  }
  out.hard_lights = hard_lights();
  lights_.build(0.5 * frame_.extent() * frame_.scale());
  std::vector<std::uint32_t> groups;
  for (const auto& [kind, numbers] : groups_) {
    groups.insert(groups.end(), numbers.begin(), numbers.end());
  }
  if (lights_.environment.exists()) {  // the last light, if it is one that is sampled
    out.environment_group = groups.back();
    groups.resize(lights_.size());
  }
  LM_CHECK(groups.size() == lights_.size(), "{} lights, {} groups", lights_.size(), groups.size());
  lights_.set_groups(std::move(groups));
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
