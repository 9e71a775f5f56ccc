#include "common/scene/compiled/material_table.h"

#include <set>

#include "common/base/overloaded.h"
#include "common/scene/casters.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/scalar_channel.h"

namespace lightmill {
namespace {

/// GGX's alpha, from the document's roughness.
float alpha_of(double roughness) {
  return static_cast<float>(roughness * roughness);
}

RgbColor normal_reflectance(const ConductorMaterial& metal) {
  const auto of = conductor::normal_reflectance<float>;
  return {of(metal.eta.r, metal.k.r), of(metal.eta.g, metal.k.g), of(metal.eta.b, metal.k.b)};
}

}  // namespace

static_assert(kNoTexture == TextureSet::kNone);

MaterialTable::MaterialTable(const Scene& scene, const MaterialRows& rows, TextureSet textures,
                             const std::vector<Vec3>& radiance, bool vertex_colors)
    : textures_(std::move(textures)), vertex_colors_(vertex_colors) {
  const std::vector<std::string> groups = light_groups_of(scene);
  std::array<std::uint32_t, std::variant_size_v<decltype(Material::kind)>> of_kind{};  // so far
  for (std::size_t i = 0; i < rows.materials.size(); ++i) {
    const Material& material = *rows.materials[i];
    add(material, scene.materials[rows.owners[i]], rows.parts[i], radiance[rows.owners[i]]);
    row_.push_back(of_kind[material.kind.index()]++);
    light_group_.push_back(number_of_group(groups, material.light_group));
  }
  std::vector<std::uint32_t> mixed(scene.materials.size());
  for (std::size_t i = scene.materials.size(); i < rows.materials.size(); ++i) {
    const auto kind = static_cast<MaterialKind>(kind_[i]);
    if (kind != MaterialKind::mixture) {
      const bool delta =
          kind == MaterialKind::mirror || kind == MaterialKind::dielectric || kind == MaterialKind::conductor;
      mixed[rows.owners[i]] |= kMixed | (delta ? 0 : kHasDensity) | (caster_[i] == 0 ? kHasReceiver : 0);
    }
  }
  for (const std::uint32_t owner : rows.owners) {
    mixed_.push_back(mixed[owner]);
  }
  std::vector<bool> in_use(scene.materials.size());
  for (const Object& object : scene.objects) {
    in_use[object.material] = true;
  }
  std::set<MaterialKind> used;
  for (std::size_t i = 0; i < rows.materials.size(); ++i) {
    if (const auto kind = static_cast<MaterialKind>(kind_[i]); in_use[rows.owners[i]]) {
      has_mixtures_ |= kind == MaterialKind::mixture;
      used.insert(kind);
    }
  }
  used.erase(MaterialKind::mixture);
  kinds_.assign(used.begin(), used.end());
  if (kinds_.size() == 1) {
    only_kind_ = kinds_.front();
  }
}

void MaterialTable::ColorColumn::add(const TexturedColor& color) {
  rgb.push_back(to_vec(color.rgb));
  texture.push_back(color.texture);
  textured = textured || color.texture != kNoTexture;
}

void MaterialTable::MapColumn::add(const ScalarMap& map) {
  texture.push_back(map.texture);
  channel.push_back(static_cast<std::uint32_t>(map.channel));
  mapped = mapped || map.texture != kNoTexture;
}

void MaterialTable::OpacityColumn::add(const Opacity& opacity, bool vertex_colors) {
  const bool always = uniform_opacity(opacity) == 1 && !vertex_colors;
  mode.push_back(static_cast<std::uint32_t>(always ? Opacity::Mode::opaque : opacity.mode));
  value.push_back(static_cast<float>(opacity.value));
  cutoff.push_back(static_cast<float>(opacity.cutoff));
  map.add(opacity.map);
}

void MaterialTable::add(const Material& material, const Material& owner, const std::array<std::uint32_t, 2>& parts,
                        const Vec3& radiance) {
  struct Entry {
    MaterialKind kind;
    bool tinted;  ///< colours of vertices multiply the reflectance
    TexturedColor reflectance, specular = {}, sheen = {};
  };
  const auto smooth = [&](double roughness) {
    return alpha_of(roughness) < ggx::kSmoothAlpha && material.roughness_map.texture == kNoTexture &&
           !is_anisotropic(material);
  };
  ScalarMap factor_map;
  const auto push = [](Column<float>& column, double value) { column.push_back(static_cast<float>(value)); };
  const auto [kind, tinted, reflectance, specular, sheen] = std::visit(
      Overloaded{[&](const DiffuseMaterial& m) -> Entry {
                   push(diffuse_.roughness, m.roughness);
                   const auto kind = !is_black(m.transmittance) ? MaterialKind::diffuse_transmission
                                     : m.roughness > 0          ? MaterialKind::rough_diffuse
                                                                : MaterialKind::diffuse;
                   return {kind, true, m.reflectance, m.transmittance};
                 },
                 [](const MirrorMaterial& m) -> Entry {
                   return {MaterialKind::mirror, true, m.reflectance};
                 },
                 [&](const DielectricMaterial& m) -> Entry {
                   dielectric_.alpha.push_back(alpha_of(m.roughness));
                   const auto kind = smooth(m.roughness) ? MaterialKind::dielectric : MaterialKind::rough_dielectric;
                   return {kind, false, {1, 1, 1}};
                 },
                 [&](const PhongMaterial& m) -> Entry {
                   push(phong_.exponent, m.exponent);
                   return {MaterialKind::phong, true, m.diffuse, m.specular};
                 },
                 [&](const ConductorMaterial& m) -> Entry {
                   conductor_.eta.push_back(to_vec(m.eta));
                   conductor_.k.push_back(to_vec(m.k));
                   conductor_.mean_fresnel.push_back(conductor::mean_fresnel(to_vec(m.eta), to_vec(m.k)));
                   conductor_.alpha.push_back(alpha_of(m.roughness));
                   const auto kind = smooth(m.roughness) ? MaterialKind::conductor : MaterialKind::rough_conductor;
                   return {kind, false, normal_reflectance(m)};
                 },
                 [](const ShadowCatcherMaterial&) -> Entry {
                   return {MaterialKind::shadow_catcher, false, {0, 0, 0}};
                 },
                 [&](const PrincipledMaterial& m) -> Entry {
                   push(principled_.metallic, m.metallic);
                   push(principled_.roughness, m.roughness);
                   push(principled_.specular, m.specular);
                   push(principled_.transmission, m.transmission);
                   push(principled_.coat, m.coat);
                   push(principled_.coat_roughness, m.coat_roughness);
                   principled_.burley.push_back(m.burley_diffuse ? 1 : 0);
                   has_burley_ |= m.burley_diffuse;
                   push(principled_.sheen_roughness, m.sheen_roughness);
                   has_sheen_ |= !is_black(m.sheen_color);
                   principled_.closed.push_back(is_sheet(material) && is_boundary(owner) ? 1 : 0);
                   has_principled_sheets_ |= is_sheet(material);
                   const TexturedColor through = is_sheet(material) ? m.transmittance : TexturedColor{};
                   return {MaterialKind::principled, true, m.base_color, through, m.sheen_color};
                 },
                 [&](const MixtureMaterial& m) -> Entry {
                   push(mixture_.factor, m.factor);
                   mixture_.first.push_back(parts[0]);
                   mixture_.second.push_back(parts[1]);
                   factor_map = m.map;
                   return {MaterialKind::mixture, false, {0, 0, 0}};
                 }},
      material.kind);
  kind_.push_back(static_cast<std::uint32_t>(kind));
  caster_.push_back(is_caster(material) ? 1 : 0);
  emits_.push_back(is_black(material.emission) ? 0 : material.two_sided_emission ? 2 : 1);
  ior_.push_back(static_cast<float>(ior_of(material)));
  reflectance_.add(reflectance);
  specular_.add(specular);
  has_specular_ = has_specular_ || !is_black(specular);
  sheen_.add(sheen);
  const Anisotropy* const anisotropy = anisotropy_of(material);  // the parts of a mixture have their own
  push(anisotropy_, anisotropy != nullptr ? anisotropy->strength : 0);
  has_anisotropy_ |= is_anisotropic(material);
  single_scattering_.push_back(material.single_scattering ? 1 : 0);
  roughness_map_.add(material.roughness_map);
  metallic_map_.add(material.metallic_map);
  factor_map_.add(factor_map);
  const auto* const principled = std::get_if<PrincipledMaterial>(&material.kind);
  const PrincipledMaterial& maps = principled != nullptr ? *principled : PrincipledMaterial{};
  specular_map_.add(maps.specular_map);
  transmission_map_.add(maps.transmission_map);
  coat_map_.add(maps.coat_map);
  coat_roughness_map_.add(maps.coat_roughness_map);
  sheen_roughness_map_.add(maps.sheen_roughness_map);
  specular_color_.add(maps.specular_color);
  has_specular_color_ |= maps.specular_color != PrincipledMaterial{}.specular_color;
  push(inner_reflectance_, maps.inner_reflectance);
  has_inner_reflectance_ |= maps.inner_reflectance > 0;
  opacity_.add(material.opacity, vertex_colors_);
  tinted_.push_back(tinted ? 1 : 0);
  emission_.add({{radiance.x, radiance.y, radiance.z}, material.emission.texture});
  emission_exponent_.push_back(static_cast<float>(material.emission_exponent));
  has_emission_profiles_ |= material.emission_exponent != 0;
}

U8 MaterialTable::drawn(Surface8 surface, M8 lanes, F8 number) const {
  for (M8 mixed = is_kind(surface.material, MaterialKind::mixture, lanes); mixed.any();
       mixed = is_kind(surface.material, MaterialKind::mixture, mixed)) {
    const U8 row = row_of(surface, mixed);
    F8 factor = mixture_.factor.at(row, mixed);
    if (factor_map_.mapped) {
      factor = factor * map_at(factor_map_, surface, mixed);
    }
    const M8 second = number < factor;
    // What is left of the number decides in a part that is a mixture.
    const F8 left = select(second, number / factor, (number - factor) / (F8(1.0f) - factor));
    number = select(mixed, min(left, F8(0x1.fffffep-1f)), number);
    surface.material =
        select(mixed, select(second, mixture_.second.at(row, mixed), mixture_.first.at(row, mixed)), surface.material);
  }
  return surface.material;
}

V8 MaterialTable::texture_at(const ColorColumn& column, const Surface8& surface, F8 footprint, M8 lanes,
                             float most) const {
  const U8 texture = column.texture.at(surface.material, lanes);
  const V8 rgb = textures_.lookup(texture, surface.u, surface.v, footprint, lanes).rgb;
  const auto clamped = [&](F8 value) { return min(max(value, F8(0.0f)), F8(most)); };
  return {clamped(rgb.x), clamped(rgb.y), clamped(rgb.z)};
}

/// Colours of vertices multiply those of kinds with a reflectance.
V8 MaterialTable::tinted_reflectance(const Surface8& surface, M8 lanes) const {
  const V8 color = at(reflectance_, surface, lanes);
  return select(tinted_.at(surface.material, lanes) == U8(1u), color * surface.color, color);
}

V8 MaterialTable::with_inner_reflectance(const V8& color, const Surface8& surface, M8 lanes) const {
  const F8 inner = inner_reflectance_.at(surface.material, lanes), one(1.0f);
  const auto seen = [&](F8 b) { return b * (one - inner) / (one - b * inner); };
  return {seen(color.x), seen(color.y), seen(color.z)};
}

/// Principled sheets reflect a share of the light that they do not transmit. Around a medium they have their base colour.
V8 MaterialTable::with_sheets(const V8& color, const V8& second, const Surface8& surface, M8 lanes) const {
  const M8 sheets = is_kind(surface.material, MaterialKind::principled, lanes);
  const M8 closed = sheets & (principled_.closed.at(row_of(surface, sheets), sheets) == U8(1u));
  return color + masked(~closed, second * (broadcast(Vec3(1)) - masked(sheets, color)));
}

F8 MaterialTable::opacity(const Surface8& surface, M8 lanes) const {
  const U8 mode = opacity_.mode.at(surface.material, lanes);
  F8 value = opacity_.value.at(surface.material, lanes);
  if (opacity_.map.mapped) {
    value = value * map_at(opacity_.map, surface, lanes);
  }
  if (vertex_colors_) {
    value = value * surface.alpha;
  }
  const M8 masks = mode == U8(static_cast<std::uint32_t>(Opacity::Mode::mask));
  const M8 there = (value >= opacity_.cutoff.at(surface.material, lanes)) | (mode == U8(0u));
  return select(masks | (mode == U8(0u)), masked(there, F8(1.0f)), value);
}

F8 MaterialTable::map_at(const MapColumn& column, const Surface8& surface, M8 lanes) const {
  const Texture::Rgba8 texel =
      textures_.lookup(column.texture.at(surface.material, lanes), surface.u, surface.v, lanes);
  return min(max(channel_of(texel, column.channel.at(surface.material, lanes)), F8(0.0f)), F8(1.0f));
}

}  // namespace lightmill
