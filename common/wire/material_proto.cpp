#include <algorithm>
#include <array>

#include "common/materials/metals.h"
#include "common/scene/document/subsurface.h"
#include "common/scene/validate/validate.h"
#include "common/wire/scene_parts.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {
namespace {

using Textures = std::vector<TextureImage>;

// ---- values → messages ----

void to_wire_kind(const DiffuseMaterial& m, const Textures& textures, v1::Material* out) {
  to_wire_textured(m.reflectance, textures, out->mutable_diffuse()->mutable_reflectance());
  out->mutable_diffuse()->set_roughness(m.roughness);
  if (m.transmittance != TexturedColor{}) {
    to_wire_textured(m.transmittance, textures, out->mutable_diffuse()->mutable_transmittance());
  }
}
void to_wire_kind(const MirrorMaterial& m, const Textures& textures, v1::Material* out) {
  to_wire_textured(m.reflectance, textures, out->mutable_mirror()->mutable_reflectance());
}
void to_wire_kind(const DielectricMaterial& m, const Textures&, v1::Material* out) {
  out->mutable_dielectric()->set_ior(m.ior);
  out->mutable_dielectric()->set_roughness(m.roughness);
}
void to_wire_kind(const PhongMaterial& m, const Textures& textures, v1::Material* out) {
  to_wire_textured(m.diffuse, textures, out->mutable_phong()->mutable_diffuse());
  to_wire_textured(m.specular, textures, out->mutable_phong()->mutable_specular());
  out->mutable_phong()->set_exponent(m.exponent);
}
/// `out`: a conductor or principled material.
void to_wire_anisotropy(const Anisotropy& anisotropy, auto* out) {
  out->set_anisotropy(anisotropy.strength);
  out->set_anisotropy_rotation_degrees(anisotropy.rotation_degrees);
}
void to_wire_kind(const ConductorMaterial& m, const Textures&, v1::Material* out) {
  to_wire_color(m.eta, out->mutable_conductor()->mutable_eta());
  to_wire_color(m.k, out->mutable_conductor()->mutable_k());
  out->mutable_conductor()->set_roughness(m.roughness);
  to_wire_anisotropy(m.anisotropy, out->mutable_conductor());
}
void to_wire_kind(const PrincipledMaterial& m, const Textures& textures, v1::Material* out) {
  v1::Material::Principled* p = out->mutable_principled();
  to_wire_textured(m.base_color, textures, p->mutable_base_color());
  p->set_metallic(m.metallic);
  p->set_roughness(m.roughness);
  p->set_specular(m.specular);
  p->set_transmission(m.transmission);
  p->set_ior(m.ior);
  p->set_coat(m.coat);
  p->set_coat_roughness(m.coat_roughness);
  p->set_burley_diffuse(m.burley_diffuse);
  to_wire_anisotropy(m.anisotropy, p);
  const PrincipledMaterial defaults;
  if (!(m.sheen_color == defaults.sheen_color)) {
    to_wire_textured(m.sheen_color, textures, p->mutable_sheen_color());
  }
  if (m.sheen_roughness != defaults.sheen_roughness) {
    p->set_sheen_roughness(m.sheen_roughness);
  }
  if (m.transmittance != defaults.transmittance) {
    to_wire_textured(m.transmittance, textures, p->mutable_transmittance());
  }
  if (m.specular_color != defaults.specular_color) {
    to_wire_textured(m.specular_color, textures, p->mutable_specular_color());
  }
  p->set_inner_reflectance(m.inner_reflectance);
  const auto put = [&](const ScalarMap& map, auto field) {
    if (map.texture != kNoTexture) {
      to_wire_map(map, textures, (p->*field)());
    }
  };
  put(m.specular_map, &v1::Material::Principled::mutable_specular_map);
  put(m.transmission_map, &v1::Material::Principled::mutable_transmission_map);
  put(m.coat_map, &v1::Material::Principled::mutable_coat_map);
  put(m.coat_roughness_map, &v1::Material::Principled::mutable_coat_roughness_map);
  put(m.sheen_roughness_map, &v1::Material::Principled::mutable_sheen_roughness_map);
}
void to_wire_kind(const ShadowCatcherMaterial&, const Textures&, v1::Material* out) {
  out->mutable_shadow_catcher();
}
/// The fields that parts of mixtures have.
void to_wire_surface(const Material& material, const Textures& textures, v1::Material* out);
void to_wire_kind(const MixtureMaterial& m, const Textures& textures, v1::Material* out) {
  to_wire_surface(*m.first, textures, out->mutable_mixture()->mutable_first());
  to_wire_surface(*m.second, textures, out->mutable_mixture()->mutable_second());
  out->mutable_mixture()->set_factor(m.factor);
  if (m.map.texture != kNoTexture) {
    to_wire_map(m.map, textures, out->mutable_mixture()->mutable_factor_map());
  }
}

// ---- messages → values ----

/// Leaves `out` unchanged if the colour is not given.
Status optional_color(const std::string& path, bool given, const v1::Color& color, const TextureNames& textures,
                      TexturedColor& out) {
  if (given) {
    LM_ASSIGN_OR_RETURN(out, textured_from_wire(path, true, color, textures));
  }
  return ok_status();
}

Result<PhongMaterial> phong_from_wire(const std::string& path, const v1::Material::Phong& phong,
                                      const TextureNames& textures) {
  PhongMaterial out;
  LM_RETURN_IF_ERROR(optional_color(path + ".diffuse", phong.has_diffuse(), phong.diffuse(), textures, out.diffuse));
  LM_RETURN_IF_ERROR(
      optional_color(path + ".specular", phong.has_specular(), phong.specular(), textures, out.specular));
  if (phong.has_exponent()) {
    out.exponent = phong.exponent();
  }
  return out;
}

Result<ConductorMaterial> conductor_from_wire(const std::string& path, const v1::Material::Conductor& conductor) {
  ConductorMaterial out;
  out.roughness = conductor.roughness();
  out.anisotropy = {conductor.anisotropy(), conductor.anisotropy_rotation_degrees()};
  if (conductor.metal().empty()) {
    if (!conductor.has_eta() && !conductor.has_k()) {
      return invalid_argument("{}: metal, or eta and k must be given", path);
    }
    LM_ASSIGN_OR_RETURN(out.eta, color_from_wire(path + ".eta", conductor.has_eta(), conductor.eta()));
    LM_ASSIGN_OR_RETURN(out.k, color_from_wire(path + ".k", conductor.has_k(), conductor.k()));
    return out;
  }
  if (conductor.has_eta() || conductor.has_k()) {
    return invalid_argument("{}.metal: give either metal, or eta and k", path);
  }
  const std::optional<Metal> metal = find_metal(conductor.metal());
  if (!metal) {
    std::string names;
    for (const Metal& known : metals()) {
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    return invalid_argument("{}.metal: unknown metal \"{}\". Known metals: {}", path, conductor.metal(), names);
  }
  out.eta = {metal->eta[0], metal->eta[1], metal->eta[2]};
  out.k = {metal->k[0], metal->k[1], metal->k[2]};
  return out;
}

Result<PrincipledMaterial> principled_from_wire(const std::string& path, const v1::Material::Principled& p,
                                                const TextureNames& textures) {
  PrincipledMaterial out;
  LM_RETURN_IF_ERROR(
      optional_color(path + ".base_color", p.has_base_color(), p.base_color(), textures, out.base_color));
  out.metallic = p.metallic();
  out.roughness = p.has_roughness() ? p.roughness() : out.roughness;
  out.specular = p.has_specular() ? p.specular() : out.specular;
  out.transmission = p.transmission();
  out.ior = p.has_ior() ? p.ior() : out.ior;
  out.coat = p.coat();
  out.coat_roughness = p.has_coat_roughness() ? p.coat_roughness() : out.coat_roughness;
  out.burley_diffuse = p.burley_diffuse();
  out.anisotropy = {p.anisotropy(), p.anisotropy_rotation_degrees()};
  LM_RETURN_IF_ERROR(
      optional_color(path + ".sheen_color", p.has_sheen_color(), p.sheen_color(), textures, out.sheen_color));
  out.sheen_roughness = p.has_sheen_roughness() ? p.sheen_roughness() : out.sheen_roughness;
  LM_RETURN_IF_ERROR(
      optional_color(path + ".transmittance", p.has_transmittance(), p.transmittance(), textures, out.transmittance));
  LM_RETURN_IF_ERROR(optional_color(path + ".specular_color", p.has_specular_color(), p.specular_color(), textures,
                                    out.specular_color));
  out.inner_reflectance = p.inner_reflectance();
  struct Map {
    const char* name;
    bool given;
    const v1::ScalarMap& from;
    ScalarMap& to;
  };
  for (const auto& [name, given, from, to] :
       {Map{".specular_map", p.has_specular_map(), p.specular_map(), out.specular_map},
        Map{".transmission_map", p.has_transmission_map(), p.transmission_map(), out.transmission_map},
        Map{".coat_map", p.has_coat_map(), p.coat_map(), out.coat_map},
        Map{".coat_roughness_map", p.has_coat_roughness_map(), p.coat_roughness_map(), out.coat_roughness_map},
        Map{".sheen_roughness_map", p.has_sheen_roughness_map(), p.sheen_roughness_map(), out.sheen_roughness_map}}) {
    if (given) {
      LM_ASSIGN_OR_RETURN(to, map_from_wire(path + name, from, textures));
    }
  }
  return out;
}

Status surface_from_wire(const std::string& path, const v1::Material& material, const TextureNames& textures,
                         Material& out);

/// Whether parts of mixtures have this field of a material.
bool is_field_of_parts(const google::protobuf::FieldDescriptor* field) {
  constexpr std::array kMaps{v1::Material::kRoughnessMapFieldNumber, v1::Material::kMetallicMapFieldNumber,
                             v1::Material::kSingleScatteringFieldNumber};
  return field->real_containing_oneof() != nullptr || std::ranges::find(kMaps, field->number()) != kMaps.end();
}

Result<std::shared_ptr<const Material>> part_from_wire(const std::string& path, const v1::Material& part,
                                                       const TextureNames& textures) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  part.GetReflection()->ListFields(part, &fields);
  if (!std::ranges::all_of(fields, is_field_of_parts)) {
    return invalid_argument(
        "{}: a part of a mixture has only its kind, roughness_map, metallic_map and single_scattering. Give the other "
        "fields to the mixture",
        path);
  }
  const auto out = std::make_shared<Material>();
  LM_RETURN_IF_ERROR(surface_from_wire(path, part, textures, *out));
  return std::shared_ptr<const Material>(out);
}

Result<MixtureMaterial> mixture_from_wire(const std::string& path, const v1::Material::Mixture& mixture,
                                          const TextureNames& textures) {
  MixtureMaterial out;
  LM_ASSIGN_OR_RETURN(out.first, part_from_wire(path + ".first", mixture.first(), textures));
  LM_ASSIGN_OR_RETURN(out.second, part_from_wire(path + ".second", mixture.second(), textures));
  out.factor = mixture.has_factor() ? mixture.factor() : out.factor;
  if (mixture.has_factor_map()) {
    LM_ASSIGN_OR_RETURN(out.map, map_from_wire(path + ".factor_map", mixture.factor_map(), textures));
  }
  return out;
}

Status kind_from_wire(const std::string& path, const v1::Material& material, const TextureNames& textures,
                      Material& out) {
  switch (material.kind_case()) {
    case v1::Material::kDiffuse: {
      const v1::Material::Diffuse& diffuse = material.diffuse();
      DiffuseMaterial kind;
      LM_ASSIGN_OR_RETURN(kind.reflectance, textured_from_wire(path + ".diffuse.reflectance", diffuse.has_reflectance(),
                                                               diffuse.reflectance(), textures));
      kind.roughness = diffuse.roughness();
      LM_RETURN_IF_ERROR(optional_color(path + ".diffuse.transmittance", diffuse.has_transmittance(),
                                        diffuse.transmittance(), textures, kind.transmittance));
      out.kind = kind;
      return ok_status();
    }
    case v1::Material::kMirror: {
      MirrorMaterial mirror;
      LM_RETURN_IF_ERROR(optional_color(path + ".mirror.reflectance", material.mirror().has_reflectance(),
                                        material.mirror().reflectance(), textures, mirror.reflectance));
      out.kind = mirror;
      return ok_status();
    }
    case v1::Material::kDielectric:
      out.kind = DielectricMaterial{material.dielectric().has_ior() ? material.dielectric().ior() : 1.5,
                                    material.dielectric().roughness()};
      return ok_status();
    case v1::Material::kPhong: {
      LM_ASSIGN_OR_RETURN(out.kind, phong_from_wire(path + ".phong", material.phong(), textures));
      return ok_status();
    }
    case v1::Material::kConductor: {
      LM_ASSIGN_OR_RETURN(out.kind, conductor_from_wire(path + ".conductor", material.conductor()));
      return ok_status();
    }
    case v1::Material::kPrincipled: {
      LM_ASSIGN_OR_RETURN(out.kind, principled_from_wire(path + ".principled", material.principled(), textures));
      return ok_status();
    }
    case v1::Material::kShadowCatcher:
      out.kind = ShadowCatcherMaterial{};
      return ok_status();
    case v1::Material::kMixture: {
      LM_ASSIGN_OR_RETURN(out.kind, mixture_from_wire(path + ".mixture", material.mixture(), textures));
      return ok_status();
    }
    case v1::Material::KIND_NOT_SET:
      break;
  }
  return invalid_argument(
      "{}: a kind of material must be given. The kinds are diffuse, mirror, dielectric, phong, conductor, principled, "
      "shadow_catcher, mixture",
      path);
}

Status surface_from_wire(const std::string& path, const v1::Material& material, const TextureNames& textures,
                         Material& out) {
  LM_RETURN_IF_ERROR(kind_from_wire(path, material, textures, out));
  out.single_scattering = material.single_scattering();
  if (material.has_roughness_map()) {
    LM_ASSIGN_OR_RETURN(out.roughness_map, map_from_wire(path + ".roughness_map", material.roughness_map(), textures));
  }
  if (material.has_metallic_map()) {
    LM_ASSIGN_OR_RETURN(out.metallic_map, map_from_wire(path + ".metallic_map", material.metallic_map(), textures));
  }
  return ok_status();
}

Result<Medium> subsurface_from_wire(const std::string& path, const v1::Material::Medium& medium) {
  if (medium.has_scattering() || medium.density_case() != v1::Material::Medium::DENSITY_NOT_SET) {
    return invalid_argument("{}.{}: give either this or subsurface", path,
                            medium.has_scattering()   ? "scattering"
                            : medium.has_absorption() ? "absorption"
                                                      : "color");
  }
  const v1::Material::Subsurface& from = medium.subsurface();
  LM_ASSIGN_OR_RETURN(const RgbColor color,
                      color_from_wire(path + ".subsurface.color", from.has_color(), from.color()));
  LM_RETURN_IF_ERROR(check_reflectance(path + ".subsurface.color", color));
  LM_ASSIGN_OR_RETURN(const RgbColor radius,
                      color_from_wire(path + ".subsurface.radius", from.has_radius(), from.radius()));
  for (const double component : {radius.r, radius.g, radius.b}) {
    LM_RETURN_IF_ERROR(check_range(path + ".subsurface.radius", component, 1 / kMaxAbsorption, kMaxAbsorption));
  }
  LM_RETURN_IF_ERROR(check_range(path + ".anisotropy", medium.anisotropy(), -kMaxMeanCosine, kMaxMeanCosine));
  return subsurface_medium(color, radius, medium.anisotropy());
}

Result<Medium> medium_from_wire(const std::string& path, const v1::Material::Medium& medium) {
  if (medium.has_subsurface()) {
    return subsurface_from_wire(path, medium);
  }
  Medium out;
  if (medium.has_absorption()) {
    LM_ASSIGN_OR_RETURN(out.absorption, color_from_wire(path + ".absorption", true, medium.absorption()));
  } else if (medium.has_color()) {
    LM_ASSIGN_OR_RETURN(const RgbColor color, color_from_wire(path + ".color", true, medium.color()));
    LM_RETURN_IF_ERROR(check_reflectance(path + ".color", color));
    out.absorption = absorption_of_color(color);
  }
  if (medium.has_scattering()) {
    LM_ASSIGN_OR_RETURN(out.scattering, color_from_wire(path + ".scattering", true, medium.scattering()));
  }
  out.anisotropy = medium.anisotropy();
  return out;
}

Result<Opacity> opacity_from_wire(const std::string& path, const v1::Opacity& opacity, const TextureNames& textures) {
  Opacity out;
  if (!v1::Opacity::Mode_IsValid(opacity.mode())) {
    return invalid_argument("{}.mode: unknown value {}", path, static_cast<int>(opacity.mode()));
  }
  out.mode = opacity.mode() == v1::Opacity::MASK ? Opacity::Mode::mask : Opacity::Mode::blend;
  out.value = opacity.has_value() ? opacity.value() : out.value;
  out.cutoff = opacity.has_cutoff() ? opacity.cutoff() : out.cutoff;
  if (opacity.has_map()) {
    LM_ASSIGN_OR_RETURN(out.map, map_from_wire(path + ".map", opacity.map(), textures));
  }
  return out;
}

void to_wire_opacity(const Opacity& opacity, const Textures& textures, v1::Opacity* out) {
  out->set_mode(opacity.mode == Opacity::Mode::mask ? v1::Opacity::MASK : v1::Opacity::BLEND);
  out->set_value(opacity.value);
  out->set_cutoff(opacity.cutoff);
  if (opacity.map.texture != kNoTexture) {
    to_wire_map(opacity.map, textures, out->mutable_map());
  }
}

void to_wire_surface(const Material& material, const Textures& textures, v1::Material* out) {
  std::visit([&](const auto& kind) { to_wire_kind(kind, textures, out); }, material.kind);
  out->set_single_scattering(material.single_scattering);
  if (material.roughness_map.texture != kNoTexture) {
    to_wire_map(material.roughness_map, textures, out->mutable_roughness_map());
  }
  if (material.metallic_map.texture != kNoTexture) {
    to_wire_map(material.metallic_map, textures, out->mutable_metallic_map());
  }
}

}  // namespace

void to_wire_material(const Material& material, const Textures& textures, v1::Material* out) {
  out->set_name(material.name);
  to_wire_surface(material, textures, out);
  to_wire_emission(material, textures, out);
  if (material.interior != Medium{}) {
    to_wire_color(material.interior.absorption, out->mutable_interior()->mutable_absorption());
    to_wire_color(material.interior.scattering, out->mutable_interior()->mutable_scattering());
    out->mutable_interior()->set_anisotropy(material.interior.anisotropy);
  }
  out->set_priority(material.priority);
  out->set_light_group(material.light_group);
  if (material.opacity.mode != Opacity::Mode::opaque) {
    to_wire_opacity(material.opacity, textures, out->mutable_opacity());
  }
  if (material.normal_map.texture != kNoTexture) {
    to_wire_normal_map(material.normal_map, textures, out->mutable_normal_map());
  }
  if (material.bump_map.map.texture != kNoTexture) {
    to_wire_bump_map(material.bump_map, textures, out->mutable_bump_map());
  }
}

Result<Material> material_from_wire(const std::string& path, const v1::Material& material,
                                    const TextureNames& textures) {
  Material out;
  out.name = material.name();
  if (out.name.empty()) {
    return invalid_argument("{}.name: must not be empty", path);
  }
  LM_RETURN_IF_ERROR(surface_from_wire(path, material, textures, out));
  LM_RETURN_IF_ERROR(emission_from_wire(path, material, textures, out));
  LM_ASSIGN_OR_RETURN(out.interior, medium_from_wire(path + ".interior", material.interior()));
  out.priority = material.priority();
  out.light_group = material.light_group();
  if (material.has_opacity()) {
    LM_ASSIGN_OR_RETURN(out.opacity, opacity_from_wire(path + ".opacity", material.opacity(), textures));
  }
  if (material.has_normal_map()) {
    LM_ASSIGN_OR_RETURN(out.normal_map, normal_map_from_wire(path + ".normal_map", material.normal_map(), textures));
  }
  if (material.has_bump_map()) {
    LM_ASSIGN_OR_RETURN(out.bump_map, bump_map_from_wire(path + ".bump_map", material.bump_map(), textures));
  }
  return out;
}

}  // namespace lightmill
