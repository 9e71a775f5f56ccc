// The materials of a scene for the renderer: structures of arrays, one row per material.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/materials/conductor.h"
#include "common/materials/diffuse_transmission.h"
#include "common/materials/phong.h"
#include "common/materials/principled.h"
#include "common/materials/rough_diffuse.h"
#include "common/materials/texture.h"
#include "common/math/column.h"
#include "common/math/exp_log.h"
#include "common/math/vec.h"
#include "common/scene/compiled/geometry_table.h"
#include "common/scene/compiled/material_rows.h"
#include "common/scene/document.h"

namespace lightmill {

enum class MaterialKind : std::uint32_t {
  diffuse,
  mirror,
  dielectric,  ///< smooth
  phong,
  conductor,  ///< smooth
  rough_conductor,
  rough_dielectric,
  principled,
  shadow_catcher,
  rough_diffuse,
  diffuse_transmission,
  mixture,  ///< never of a surface: MaterialTable::drawn replaces it by a part
};

class MaterialTable {
 public:
  MaterialTable() = default;
  /// `rows`: of the scene. `radiance`: one per material, emitted along the normal. It is multiplied by its texture.
  /// `vertex_colors`: surfaces have colours of their vertices.
  MaterialTable(const Scene& scene, const MaterialRows& rows, TextureSet textures, const std::vector<Vec3>& radiance,
                bool vertex_colors = false);

  /// The kinds of the objects' materials, ascending.
  const std::vector<MaterialKind>& kinds() const { return kinds_; }
  /// The only kind, if there is just one.
  std::optional<MaterialKind> only_kind() const { return only_kind_; }

  bool has_mixtures() const { return has_mixtures_; }
  /// The material of each surface. A mixture is replaced by the part that the number in [0, 1) draws.
  U8 drawn(Surface8 surface, M8 lanes, F8 number) const;

  /// Lanes whose material is a part of a mixture. Some part has a density, or is no caster.
  struct Mixed8 {
    M8 lanes, has_density, has_receiver;
  };
  Mixed8 mixed(U8 material, M8 lanes) const {
    const U8 of = mixed_.at(material, lanes);
    const auto bit = [&](std::uint32_t mask) { return and_not(lanes, (of & U8(mask)) == U8(0u)); };
    return {bit(kMixed), bit(kHasDensity), bit(kHasReceiver)};
  }

  bool uses(MaterialKind kind) const { return std::ranges::find(kinds_, kind) != kinds_.end(); }

  /// Casters: see is_caster.
  M8 casters(U8 material, M8 lanes) const { return lanes & (caster_.at(material, lanes) == U8(1u)); }

  M8 is_kind(U8 material, MaterialKind kind, M8 lanes) const {
    return lanes & (kind_.at(material, lanes) == U8(static_cast<std::uint32_t>(kind)));
  }
  /// The reflectance of diffuse surfaces and mirrors. For other kinds, their base colour.
  V8 reflectance(const Surface8& surface, M8 lanes) const {
    const V8 color = vertex_colors_ ? tinted_reflectance(surface, lanes) : at(reflectance_, surface, lanes);
    return has_inner_reflectance_ ? with_inner_reflectance(color, surface, lanes) : color;
  }
  /// The approximate share of light that each channel scatters. 1 for clear glass.
  V8 albedo(const Surface8& surface, M8 lanes) const {
    const V8 color = reflectance(surface, lanes);
    if (!has_specular_) {
      return color;
    }
    const V8 second = at(specular_, surface, lanes);
    return has_principled_sheets_ ? with_sheets(color, second, surface, lanes) : color + second;
  }
  /// Index of refraction inside. 1 for kinds without one.
  F8 ior(const Surface8& surface, M8 lanes) const { return ior_.at(surface.material, lanes); }
  /// `eta`: index of refraction behind the surface over that on the ray's side.
  RoughDielectric8 dielectric(const Surface8& surface, F8 eta, M8 lanes) const {
    return {eta, mapped_alpha(dielectric_.alpha.at(row_of(surface, lanes), lanes), surface, lanes), broadcast(Vec3(1)),
            compensated(surface, lanes)};
  }
  Conductor8 conductor(const Surface8& surface, M8 lanes) const {
    const U8 row = row_of(surface, lanes);
    const F8 alpha = mapped_alpha(conductor_.alpha.at(row, lanes), surface, lanes);
    return {conductor_.eta.at(row, lanes), conductor_.k.at(row, lanes),
            has_anisotropy_ ? ggx::Facets8(alpha, anisotropy_.at(surface.material, lanes), surface.directed)
                            : ggx::Facets8(alpha),
            masked(compensated(surface, lanes), conductor_.mean_fresnel.at(row, lanes))};
  }
  RoughDiffuse8 rough_diffuse(const Surface8& surface, M8 lanes) const {
    const F8 roughness = diffuse_.roughness.at(row_of(surface, lanes), lanes);
    return {reflectance(surface, lanes), times(roughness, roughness_map_, surface, lanes), compensated(surface, lanes)};
  }
  /// Where both colours add up to more than 1, the transmittance is lowered.
  DiffuseTransmission8 diffuse_transmission(const Surface8& surface, M8 lanes) const {
    const V8 reflected = reflectance(surface, lanes), through = at(specular_, surface, lanes);
    const auto rest = [](F8 part, F8 other) { return min(part, max(F8(1.0f) - other, F8(0.0f))); };
    return {reflected, {rest(through.x, reflected.x), rest(through.y, reflected.y), rest(through.z, reflected.z)}};
  }
  Phong8 phong(const Surface8& surface, M8 lanes) const {
    return {reflectance(surface, lanes), at(specular_, surface, lanes),
            phong_.exponent.at(row_of(surface, lanes), lanes)};
  }
  PrincipledParameters8 principled(const Surface8& surface, M8 lanes) const {
    const U8 row = row_of(surface, lanes);
    PrincipledParameters8 out{reflectance(surface, lanes),
                              times(principled_.metallic.at(row, lanes), metallic_map_, surface, lanes),
                              times(principled_.roughness.at(row, lanes), roughness_map_, surface, lanes),
                              times(principled_.specular.at(row, lanes), specular_map_, surface, lanes),
                              times(principled_.transmission.at(row, lanes), transmission_map_, surface, lanes),
                              ior(surface, lanes),
                              times(principled_.coat.at(row, lanes), coat_map_, surface, lanes),
                              times(principled_.coat_roughness.at(row, lanes), coat_roughness_map_, surface, lanes),
                              compensated(surface, lanes),
                              has_burley_ ? lanes & (principled_.burley.at(row, lanes) == U8(1u)) : M8()};
    if (has_anisotropy_) {
      out.anisotropy = {anisotropy_.at(surface.material, lanes), surface.directed};
    }
    if (has_principled_sheets_) {
      out.sheet = {masked(lanes, at(specular_, surface, lanes)), lanes & (principled_.closed.at(row, lanes) == U8(1u))};
    }
    if (has_specular_color_) {
      out.specular_color = at(specular_color_, surface, lanes);
    }
    if (has_sheen_) {
      out.sheen = {masked(lanes, at(sheen_, surface, lanes)),
                   times(principled_.sheen_roughness.at(row, lanes), sheen_roughness_map_, surface, lanes)};
    }
    return out;
  }
  /// Emitted radiance at this positive cosine to the normal. It has no footprint, as the lights' table has none.
  V8 emission(const Surface8& surface, F8 cosine, M8 lanes) const {
    const V8 along_normal = at(emission_, surface, F8(0.0f), lanes, std::numeric_limits<float>::max());
    return has_emission_profiles_ ? along_normal * pow(cosine, emission_exponent_.at(surface.material, lanes))
                                  : along_normal;
  }
  const TextureSet& textures() const { return textures_; }
  /// Whether rays may pass surfaces of these materials (Opacity).
  M8 may_pass(U8 material, M8 lanes) const { return and_not(lanes, opacity_.mode.at(material, lanes) == U8(0u)); }
  /// In [0, 1].
  F8 opacity(const Surface8& surface, M8 lanes) const;
  /// 1 + the index in light_groups_of(scene). 0: none.
  U8 light_group(const Surface8& surface, M8 lanes) const { return light_group_.at(surface.material, lanes); }
  /// The hits that see emitted light, given the side that was hit.
  M8 emits(const Surface8& surface, M8 lanes) const {
    const U8 sides = emits_.at(surface.material, lanes);
    return lanes & (((sides == U8(1u)) & surface.front) | (sides == U8(2u)));
  }

 private:
  /// One colour of all materials.
  struct ColorColumn {
    VectorColumn rgb;
    Column<std::uint32_t> texture;  ///< or TextureSet::kNone
    bool textured = false;
    void add(const TexturedColor& color);
  };
  V8 at(const ColorColumn& column, const Surface8& surface, M8 lanes) const {
    return at(column, surface, surface.footprint, lanes, 1);
  }
  /// Texels are clamped to [0, `most`].
  V8 at(const ColorColumn& column, const Surface8& surface, F8 footprint, M8 lanes, float most) const {
    const V8 rgb = column.rgb.at(surface.material, lanes);
    return column.textured ? rgb * texture_at(column, surface, footprint, lanes, most) : rgb;
  }
  V8 tinted_reflectance(const Surface8& surface, M8 lanes) const;
  /// Base colours below surfaces that send light back.
  V8 with_inner_reflectance(const V8& color, const Surface8& surface, M8 lanes) const;
  /// The albedo where some surfaces are principled sheets.
  V8 with_sheets(const V8& color, const V8& second, const Surface8& surface, M8 lanes) const;
  V8 texture_at(const ColorColumn& column, const Surface8& surface, F8 footprint, M8 lanes, float most) const;

  /// One number with a map, of all materials.
  struct MapColumn {
    Column<std::uint32_t> texture;  ///< or TextureSet::kNone
    Column<std::uint32_t> channel;
    bool mapped = false;
    void add(const ScalarMap& map);
  };
  /// In [0, 1]. 1 without a texture.
  F8 map_at(const MapColumn& column, const Surface8& surface, M8 lanes) const;
  F8 times(F8 number, const MapColumn& column, const Surface8& surface, M8 lanes) const {
    return column.mapped ? number * map_at(column, surface, lanes) : number;
  }
  F8 mapped_alpha(F8 alpha, const Surface8& surface, M8 lanes) const {
    if (!roughness_map_.mapped) {
      return alpha;
    }
    const F8 factor = map_at(roughness_map_, surface, lanes);
    return alpha * (factor * factor);
  }
  /// The opacity of all materials.
  struct OpacityColumn {
    Column<std::uint32_t> mode;  ///< Opacity::Mode, opaque where the opacity is always 1
    Column<float> value, cutoff;
    MapColumn map;
    void add(const Opacity& opacity, bool vertex_colors);
  };
  M8 compensated(const Surface8& surface, M8 lanes) const {
    return single_scattering_.at(surface.material, lanes) == U8(0u);
  }
  U8 row_of(const Surface8& surface, M8 lanes) const { return row_.at(surface.material, lanes); }
  /// `owner` is the material of the surface. `material` is the same one, or a part of it.
  void add(const Material& material, const Material& owner, const std::array<std::uint32_t, 2>& parts,
           const Vec3& radiance);

  TextureSet textures_;
  std::vector<MaterialKind> kinds_;
  std::optional<MaterialKind> only_kind_;
  // One entry per material.
  Column<std::uint32_t> kind_;
  Column<std::uint32_t> row_;     ///< of the material in its kind's columns
  Column<std::uint32_t> caster_;  ///< 0 or 1
  Column<std::uint32_t> tinted_;  ///< 1: the kind has a reflectance, which colours of vertices multiply
  static constexpr std::uint32_t kMixed = 1, kHasDensity = 2, kHasReceiver = 4;
  Column<std::uint32_t> mixed_;                            ///< of parts of mixtures: these bits
  Column<std::uint32_t> emits_;                            ///< 0 never, 1 on the front, 2 on both sides
  ColorColumn reflectance_, specular_, emission_, sheen_;  ///< specular_ is also the transmittance of sheets
  ColorColumn specular_color_;                             ///< of principled materials; else white
  MapColumn roughness_map_, metallic_map_, factor_map_;
  MapColumn specular_map_, transmission_map_, coat_map_, coat_roughness_map_, sheen_roughness_map_;
  OpacityColumn opacity_;
  bool has_specular_ = false, has_mixtures_ = false;
  bool vertex_colors_ = false;
  Column<float> ior_, emission_exponent_, anisotropy_, inner_reflectance_;
  Column<std::uint32_t> light_group_;
  Column<std::uint32_t> single_scattering_;  ///< 0 or 1
  bool has_emission_profiles_ = false;       ///< an exponent is not 0
  // Fields of a kind other than colours and an index. One row per material of the kind (row_).
  struct {
    Column<float> factor;
    Column<std::uint32_t> first, second;  ///< rows of the parts
  } mixture_;
  struct {
    Column<float> roughness;
  } diffuse_;
  struct {
    Column<float> alpha;
  } dielectric_;
  struct {
    VectorColumn eta, k, mean_fresnel;
    Column<float> alpha;
  } conductor_;
  struct {
    Column<float> exponent;
  } phong_;
  struct {
    Column<float> metallic, roughness, specular, transmission, coat, coat_roughness, sheen_roughness;
    Column<std::uint32_t> burley;  ///< 0 or 1
    Column<std::uint32_t> closed;  ///< 1: a sheet around a medium
  } principled_;
  bool has_burley_ = false, has_anisotropy_ = false, has_sheen_ = false, has_principled_sheets_ = false;
  bool has_specular_color_ = false, has_inner_reflectance_ = false;
};

}  // namespace lightmill
