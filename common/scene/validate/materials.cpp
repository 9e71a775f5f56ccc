#include "common/scene/validate/parts.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "common/base/overloaded.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

Status check_ior(const std::string& path, double ior) {
  return ior > 0 && ior <= kMaxIor ? ok_status()
                                   : invalid_argument("{}: must be in (0, {}], got {}", path, kMaxIor, ior);
}

Status check_phong(const std::string& path, const PhongMaterial& phong) {
  LM_RETURN_IF_ERROR(check_reflectance(path + ".diffuse", phong.diffuse.rgb));
  LM_RETURN_IF_ERROR(check_reflectance(path + ".specular", phong.specular.rgb));
  constexpr float kRounding = 1e-6f;
  for (const auto& [d, s] : {std::pair{phong.diffuse.rgb.r, phong.specular.rgb.r},
                             {phong.diffuse.rgb.g, phong.specular.rgb.g},
                             {phong.diffuse.rgb.b, phong.specular.rgb.b}}) {
    if (d + s > 1 + kRounding) {
      return invalid_argument("{}: diffuse + specular may not exceed 1 in any channel, got {} + {}", path, d, s);
    }
  }
  return check_range(path + ".exponent", phong.exponent, 0, kMaxPhongExponent);
}

Status check_anisotropy(const std::string& path, const Anisotropy& anisotropy) {
  LM_RETURN_IF_ERROR(check_range(path + ".anisotropy", anisotropy.strength, 0, 1));
  return check_range(path + ".anisotropy_rotation_degrees", anisotropy.rotation_degrees, -kMaxRotationDegrees,
                     kMaxRotationDegrees);
}

Status check_conductor(const std::string& path, const ConductorMaterial& metal) {
  LM_RETURN_IF_ERROR(check_components(path + ".eta", metal.eta, kMaxComplexIndex));
  LM_RETURN_IF_ERROR(check_components(path + ".k", metal.k, kMaxComplexIndex));
  for (const auto& [n, k] : {std::pair{metal.eta.r, metal.k.r}, {metal.eta.g, metal.k.g}, {metal.eta.b, metal.k.b}}) {
    if (n == 0 && k == 0) {
      return invalid_argument("{}: eta and k may not both be 0 in a channel", path);
    }
  }
  LM_RETURN_IF_ERROR(check_anisotropy(path, metal.anisotropy));
  return check_range(path + ".roughness", metal.roughness, 0, 1);
}

Status check_principled(const std::string& path, const PrincipledMaterial& m) {
  LM_RETURN_IF_ERROR(check_reflectance(path + ".base_color", m.base_color.rgb));
  for (const auto& [field, value] : {std::pair{".metallic", m.metallic},
                                     {".roughness", m.roughness},
                                     {".specular", m.specular},
                                     {".transmission", m.transmission},
                                     {".coat", m.coat},
                                     {".coat_roughness", m.coat_roughness},
                                     {".sheen_roughness", m.sheen_roughness}}) {
    LM_RETURN_IF_ERROR(check_range(path + field, value, 0, 1));
  }
  LM_RETURN_IF_ERROR(check_reflectance(path + ".sheen_color", m.sheen_color.rgb));
  LM_RETURN_IF_ERROR(check_reflectance(path + ".transmittance", m.transmittance.rgb));
  LM_RETURN_IF_ERROR(check_reflectance(path + ".specular_color", m.specular_color.rgb));
  LM_RETURN_IF_ERROR(check_range(path + ".inner_reflectance", m.inner_reflectance, 0, kMaxInnerReflectance));
  LM_RETURN_IF_ERROR(check_anisotropy(path, m.anisotropy));
  for (const auto& [name, map, number] : {std::tuple{"specular", m.specular_map, m.specular},
                                          {"transmission", m.transmission_map, m.transmission},
                                          {"coat", m.coat_map, m.coat},
                                          {"coat_roughness", m.coat_roughness_map, m.coat_roughness},
                                          {"sheen_roughness", m.sheen_roughness_map, m.sheen_roughness}}) {
    if (map.texture != kNoTexture && !(number > 0)) {
      return invalid_argument("{}.{}_map: multiplies {}, which must be above 0", path, name, name);
    }
  }
  return check_ior(path + ".ior", m.ior);
}

/// None for kinds of material without roughness.
std::optional<double> roughness_of(const Material& material) {
  return std::visit(
      [](const auto& m) -> std::optional<double> {
        if constexpr (requires { m.roughness; }) {
          return m.roughness;
        }
        return std::nullopt;
      },
      material.kind);
}

Status check_maps(const std::string& path, const Material& material) {
  if (material.roughness_map.texture != kNoTexture && !(roughness_of(material) > 0)) {
    return invalid_argument(
        "{}.roughness_map: multiplies the roughness of a diffuse, dielectric, conductor or principled material, which "
        "must be above 0",
        path);
  }
  if (material.metallic_map.texture != kNoTexture && !std::holds_alternative<PrincipledMaterial>(material.kind)) {
    return invalid_argument("{}.metallic_map: only a principled material has one", path);
  }
  if (material.single_scattering && !roughness_of(material)) {
    return invalid_argument("{}.single_scattering: only a diffuse, dielectric, conductor or principled material has it",
                            path);
  }
  const bool normals = material.normal_map.texture != kNoTexture, bumps = material.bump_map.map.texture != kNoTexture;
  if (normals && bumps) {
    return invalid_argument("{}.bump_map: give either a normal map or a bump map", path);
  }
  if ((normals || bumps) && std::holds_alternative<ShadowCatcherMaterial>(material.kind)) {
    return invalid_argument("{}.{}: a shadow catcher has no shading normals", path,
                            normals ? "normal_map" : "bump_map");
  }
  constexpr double kMaxScale = 1e6;
  LM_RETURN_IF_ERROR(check_range(path + ".normal_map.scale", material.normal_map.scale, -kMaxScale, kMaxScale));
  return check_range(path + ".bump_map.height", material.bump_map.height, -kMaxCoordinate, kMaxCoordinate);
}

Status check_opacity(const std::string& path, const Material& material) {
  if (material.opacity.mode == Opacity::Mode::opaque) {
    return ok_status();
  }
  if (is_boundary(material)) {
    return invalid_argument("{}.opacity: light enters this material, so it has no opacity", path);
  }
  if (material.emission_unit == EmissionUnit::flux && !uniform_opacity(material.opacity)) {
    return invalid_argument(
        "{}: \"{}\" states a power (emission_flux, or emission_strength in watt or lumen), but its opacity varies: give "
        "radiance or watts per square metre",
        path, printable(material.name));
  }
  LM_RETURN_IF_ERROR(check_range(path + ".opacity.value", material.opacity.value, 0, 1));
  return check_range(path + ".opacity.cutoff", material.opacity.cutoff, 0, 1);
}

Status check_surface(const std::string& path, const Material& material);

/// A part of a mixture, which may be one.
Status check_part(const std::string& path, const Material& part) {
  if (std::holds_alternative<ShadowCatcherMaterial>(part.kind)) {
    return invalid_argument("{}: a shadow catcher cannot be part of a mixture", path);
  }
  return check_surface(path, part);
}

Status check_mixture(const std::string& path, const MixtureMaterial& m) {
  LM_RETURN_IF_ERROR(check_range(path + ".factor", m.factor, 0, 1));
  LM_RETURN_IF_ERROR(check_part(path + ".first", *m.first));
  LM_RETURN_IF_ERROR(check_part(path + ".second", *m.second));
  if (is_glass(*m.first) && is_glass(*m.second) && ior_of(*m.first) != ior_of(*m.second)) {
    return invalid_argument("{}: glass of one mixture must have one index of refraction, got {} and {}", path,
                            ior_of(*m.first), ior_of(*m.second));
  }
  return ok_status();
}

/// The fields that parts of mixtures have.
Status check_surface(const std::string& path, const Material& material) {
  LM_RETURN_IF_ERROR(std::visit(
      Overloaded{
          [&](const DiffuseMaterial& m) {
            LM_RETURN_IF_ERROR(check_reflectance(path + ".diffuse.reflectance", m.reflectance.rgb));
            LM_RETURN_IF_ERROR(check_reflectance(path + ".diffuse.transmittance", m.transmittance.rgb));
            if (m.roughness > 0 && !is_black(m.transmittance)) {
              return invalid_argument("{}.diffuse.roughness: must be 0 with a transmittance", path);
            }
            return check_range(path + ".diffuse.roughness", m.roughness, 0, 1);
          },
          [&](const MirrorMaterial& m) { return check_reflectance(path + ".mirror.reflectance", m.reflectance.rgb); },
          [&](const DielectricMaterial& m) {
            LM_RETURN_IF_ERROR(check_ior(path + ".dielectric.ior", m.ior));
            return check_range(path + ".dielectric.roughness", m.roughness, 0, 1);
          },
          [&](const PhongMaterial& m) { return check_phong(path + ".phong", m); },
          [&](const ConductorMaterial& m) { return check_conductor(path + ".conductor", m); },
          [&](const PrincipledMaterial& m) { return check_principled(path + ".principled", m); },
          [&](const ShadowCatcherMaterial&) {
            return material.emission == TexturedColor{}
                       ? ok_status()
                       : invalid_argument("{}.emission: a shadow catcher cannot emit light", path);
          },
          [&](const MixtureMaterial& m) { return check_mixture(path + ".mixture", m); }},
      material.kind));
  return check_maps(path, material);
}

Status check_kind(const std::string& path, const Material& material) {
  if (const std::size_t parts = count_parts(material); parts > kMaxMixtureParts) {
    return invalid_argument("{}.mixture: at most {} parts are possible, got {}", path, kMaxMixtureParts, parts);
  }
  LM_RETURN_IF_ERROR(check_surface(path, material));
  LM_RETURN_IF_ERROR(check_opacity(path, material));
  LM_RETURN_IF_ERROR(check_components(path + ".interior.absorption", material.interior.absorption, kMaxAbsorption));
  LM_RETURN_IF_ERROR(check_components(path + ".interior.scattering", material.interior.scattering, kMaxAbsorption));
  LM_RETURN_IF_ERROR(
      check_range(path + ".interior.anisotropy", material.interior.anisotropy, -kMaxMeanCosine, kMaxMeanCosine));
  if (!is_boundary(material) && (material.interior != Medium{} || material.priority != 0)) {
    return invalid_argument(
        "{}.{}: only a dielectric, a principled material with transmission, or a diffuse or principled one with a "
        "transmittance, has an inside",
        path, material.interior != Medium{} ? "interior" : "priority");
  }
  return ok_status();
}

}  // namespace

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
  if (texture.tile != 0 && (texture.tile < kFirstTile || texture.tile > kLastTile)) {
    return invalid_argument("{}.tile: a UDIM number from {} to {} is expected, got {}", path, kFirstTile, kLastTile,
                            texture.tile);
  }
  return check_range(path + ".rotation_degrees", texture.rotation_degrees, -kMaxRotationDegrees, kMaxRotationDegrees);
}

Status check_tiles(const std::vector<TextureImage>& textures) {
  std::set<std::pair<std::uint32_t, int>> taken;  // the texture, and the number of its tile
  for (std::uint32_t i = 0; i < textures.size(); ++i) {
    const auto& [tile, of] = std::pair{textures[i].tile, textures[i].tile_of};
    const std::string path = fmt::format("textures[{}]", i);
    if (of != kNoTexture && (of >= i || textures[of].tile == 0 || textures[of].tile_of != kNoTexture || tile == 0)) {
      return invalid_argument(
          "{}.tile_of: the texture and the one that it names must both have a tile, and that one no "
          "tile_of",
          path);
    }
    if (tile != 0 && !taken.emplace(of == kNoTexture ? i : of, tile).second) {
      return invalid_argument("{}.tile: the texture has an image for tile {} already", path, tile);
    }
  }
  return ok_status();
}

Status check_material(const std::string& path, const Material& material) {
  if (material.name.empty()) {
    return invalid_argument("{}.name: must not be empty", path);
  }
  LM_RETURN_IF_ERROR(check_kind(path, material));
  LM_RETURN_IF_ERROR(check_range(path + ".emission_exponent", material.emission_exponent, 0, kMaxCosineExponent));
  if (material.emission_unit == EmissionUnit::flux && material.emission.texture != kNoTexture) {
    return invalid_argument(
        "{}: \"{}\" states a power (emission_flux, or emission_strength in watt or lumen), but its emission has a "
        "texture: give radiance or watts per square metre",
        path, printable(material.name));
  }
  LM_RETURN_IF_ERROR(check_group(path + ".light_group", material.light_group));
  return check_power(path + ".emission", material.emission.rgb);
}

std::string describe_unknown_material(std::string_view name, const std::vector<Material>& materials) {
  std::string text = fmt::format("unknown material \"{}\". ", cut_text(printable(name), kMaxNameBytes));
  if (materials.empty()) {
    return text + "There are no materials";
  }
  text += "Known materials: ";
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 0; i < std::min(materials.size(), kShown); ++i) {
    text += (i > 0 ? ", " : "") + cut_text(printable(materials[i].name), kMaxNameBytes);
  }
  if (materials.size() > kShown) {
    text += fmt::format(" and {} more", materials.size() - kShown);
  }
  return text;
}

}  // namespace lightmill
