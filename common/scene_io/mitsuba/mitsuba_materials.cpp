#include "common/scene_io/mitsuba/mitsuba_materials.h"

#include <algorithm>
#include <cmath>

#include "common/materials/metals.h"
#include "common/scene_io/coat.h"
#include "common/scene_io/mixing.h"
#include "common/scene_io/rough_axes.h"
#include "common/scene_io/thin_glass.h"

namespace lightmill {
namespace {

RgbColor color_of(const std::array<float, 3>& v) {
  return {v[0], v[1], v[2]};
}

/// √ln 2. Half of the facets have slopes below alpha with GGX, and below √ln 2 alpha with Beckmann's distribution.
constexpr double kBeckmannToGgx = 0.8325546;

bool has_beckmann_facets(const MitsubaObject& from) {
  return from.text("distribution", "beckmann") == "beckmann";
}

}  // namespace

Result<MitsubaSurface> MitsubaMaterials::convert(const MitsubaObject& bsdf) {
  constexpr int kMaxNested = 50;
  if (const auto found = known_.find(&bsdf); found != known_.end()) {
    return found->second;
  }
  if (nesting_ == kMaxNested) {
    return bsdf.place.error("materials are nested more than {} deep", kMaxNested);
  }
  ++nesting_;
  Result<MitsubaSurface> out = read(bsdf);
  --nesting_;
  if (out.ok()) {
    if (const Status finished = bsdf.finish(faults_); !finished.ok()) {
      out = finished;
    } else {
      out->material.name = bsdf.label();
    }
  }
  return known_.emplace(&bsdf, std::move(out)).first->second;
}

Result<MitsubaSurface> MitsubaMaterials::read(const MitsubaObject& from) {
  if (from.type == "twosided") {
    LM_ASSIGN_OR_RETURN(MitsubaSurface out, nested(from));
    out.one_sided = false;
    return out;
  }
  if (from.type == "mask") {
    return masked(from);
  }
  if (from.type == "blendbsdf") {
    return blended(from);
  }
  if (from.type == "bumpmap" || from.type == "normalmap") {
    return normal_mapped(from);
  }
  MitsubaSurface out;
  set_kind(from, out);
  return out;
}

Result<MitsubaSurface> MitsubaMaterials::nested(const MitsubaObject& from) {
  const std::vector<const MitsubaObject*> all = from.nested("bsdf");
  return all.size() == 1 ? convert(*all[0])
                         : from.place.error("{}: one nested bsdf can be rendered, got {}", from.what(), all.size());
}

Result<MitsubaSurface> MitsubaMaterials::masked(const MitsubaObject& from) {
  LM_ASSIGN_OR_RETURN(MitsubaSurface out, nested(from));
  const TexturedColor opacity = textures_.number(from, "opacity", 0.5, 0, 1);
  if (opacity.texture == kNoTexture && opacity.rgb.r == 1) {
    return out;
  }
  if (is_boundary(out.material) || out.null || out.material.opacity.mode != Opacity::Mode::opaque) {
    return from.place.error("{}: a mask of glass, of null or of another mask cannot be rendered", from.what());
  }
  out.material.opacity = {Opacity::Mode::blend, opacity.rgb.r, {opacity.texture}};
  return out;
}

Result<MitsubaSurface> MitsubaMaterials::blended(const MitsubaObject& from) {
  const std::vector<const MitsubaObject*> all = from.nested("bsdf");
  const TexturedColor weight = textures_.number(from, "weight", 0.5, 0, 1);
  if (all.size() != 2) {
    return from.place.error("{}: two nested bsdfs are expected, got {}", from.what(), all.size());
  }
  const float t = weight.rgb.r;
  LM_ASSIGN_OR_RETURN(MitsubaSurface a, convert(*all[0]));
  LM_ASSIGN_OR_RETURN(MitsubaSurface b, convert(*all[1]));
  if (t == 0 || (t == 1 && weight.texture == kNoTexture)) {
    return t == 0 ? a : b;
  }
  Result<Material> material = mixed(a.material, b.material, t, {weight.texture}, notices_);
  if (!material.ok()) {
    return from.place.error("{}: {}", from.what(), message_of(material.status()));
  }
  return MitsubaSurface{*std::move(material), false, a.one_sided || b.one_sided};
}

Result<MitsubaSurface> MitsubaMaterials::normal_mapped(const MitsubaObject& from) {
  LM_ASSIGN_OR_RETURN(MitsubaSurface out, nested(from));
  if (has_mapped_normals(out.material)) {
    return from.place.error("{}: a second bump map or normal map cannot be rendered", from.what());
  }
  const bool bump = from.type == "bumpmap";
  std::vector<const MitsubaObject*> textures = from.nested("texture");
  if (textures.size() != 1) {
    return from.place.error("{}: one nested texture is expected, got {}", from.what(), textures.size());
  }
  const std::uint32_t image = textures_.data(from, *textures[0]);
  from.ignore({"flip_invalid_normals", "use_shadowing_function"});
  if (!bump) {
    out.material.normal_map = {image, 1};
  } else if (const double scale = from.number("scale", 1, -1e6, 1e6); image != kNoTexture) {
    out.material.bump_map = {{image}, scale};
  }
  return out;
}

void MitsubaMaterials::set_kind(const MitsubaObject& from, MitsubaSurface& out) {
  const std::string& type = from.type;
  Material& material = out.material;
  out.one_sided = true;
  if (type == "diffuse") {
    material.kind = DiffuseMaterial{textures_.color(from, "reflectance", {0.5f, 0.5f, 0.5f})};
  } else if (type == "conductor" || type == "roughconductor") {
    conductor(from, material);
  } else if (type == "plastic" || type == "roughplastic") {
    plastic(from, material);
  } else if (type == "principled") {
    principled(from, out);
  } else if (type == "dielectric" || type == "roughdielectric") {
    out.one_sided = false;
    material.kind = DielectricMaterial{textures_.ior(from, "bk7"), roughness(from)};
    material.single_scattering = true;
    require_one(from, "specular_reflectance");
    require_one(from, "specular_transmittance");
  } else if (type == "thindielectric") {
    out.one_sided = false;
    thin_dielectric(from, material);
  } else if (type == "null") {
    out.one_sided = false;
    out.null = true;
    material.kind = DielectricMaterial{1, 0};
  } else {
    from.fail(from.place.error("materials of the type \"{}\" cannot be rendered", type));
  }
}

void MitsubaMaterials::thin_dielectric(const MitsubaObject& from, Material& out) {
  notices_.once("thindielectric reflects the same share at all angles: that of light along the normal");
  out = thin_glass(textures_.ior(from, "bk7"));
  require_one(from, "specular_reflectance");
  require_one(from, "specular_transmittance");
}

void MitsubaMaterials::require_one(const MitsubaObject& from, std::string_view name) {
  const TexturedColor factor = textures_.color(from, name, {1, 1, 1});
  if (!(factor == TexturedColor(1, 1, 1))) {
    from.fail(name, "only 1 can be rendered");
  }
}

std::array<double, 2> MitsubaMaterials::alphas(const MitsubaObject& from) {
  if (!from.type.starts_with("rough")) {
    return {0, 0};
  }
  from.ignore({"sample_visible"});
  if (has_beckmann_facets(from)) {
    notices_.once("rough surfaces with the distribution \"beckmann\" are rendered with GGX of the same median slope");
  } else if (from.text("distribution", "") != "ggx") {
    from.fail("distribution", "beckmann or ggx is expected");
  }
  const auto value = [&](std::string_view name, double fallback) -> double {
    const TexturedColor read = textures_.number(from, name, fallback, 0, 1);
    if (read.texture != kNoTexture) {
      notices_.left_out("textures of roughness: half of their largest value counts");
    }
    return read.texture == kNoTexture ? read.rgb.r : read.rgb.r / 2;
  };
  const double both = value("alpha", 0.1), u = value("alpha_u", both), v = value("alpha_v", both);
  const double factor = has_beckmann_facets(from) ? kBeckmannToGgx : 1;
  return {u * factor, v * factor};
}

double MitsubaMaterials::roughness(const MitsubaObject& from) {
  const auto [u, v] = alphas(from);
  if (u != v) {
    notices_.once("glass that is rougher along one axis has the mean roughness");
  }
  return std::sqrt(std::sqrt(u * v));
}

void MitsubaMaterials::conductor(const MitsubaObject& from, Material& out) {
  ConductorMaterial metal;
  const auto [u, v] = alphas(from);
  const RoughAxes axes = rough_axes(u, v);
  metal.roughness = axes.roughness;
  metal.anisotropy = axes.anisotropy;
  out.single_scattering = true;
  const std::string name = from.text("material", "none");
  if (name != "none" && (from.has("eta") || from.has("k"))) {
    from.fail("material", "cannot be given together with eta and k");
  } else if (name != "none") {
    const std::optional<Metal> known = metal_of_symbol(name.substr(0, name.find('_')));
    if (!known) {
      return from.fail("material", fmt::format("unknown metal \"{}\": give eta and k", name));
    }
    metal.eta = color_of(known->eta);
    metal.k = color_of(known->k);
  } else {
    metal.eta = textures_.metal(from, "eta", 0);
    metal.k = textures_.metal(from, "k", 1);
  }
  const auto nothing = [](float n, float absorbed) { return n == 0 && absorbed == 0; };
  if (nothing(metal.eta.r, metal.k.r) || nothing(metal.eta.g, metal.k.g) || nothing(metal.eta.b, metal.k.b)) {
    return from.fail("eta", "eta and k must not both be 0 at 650, 550 or 450 nm");
  }
  out.kind = metal;
  const TexturedColor factor = textures_.color(from, "specular_reflectance", {1, 1, 1});
  const bool mirror = is_black(metal.eta);  // reflects everything, whatever k is
  if (mirror && metal.roughness == 0) {
    out.kind = MirrorMaterial{factor};
    out.single_scattering = false;
  } else if (mirror && !(factor == TexturedColor(1, 1, 1))) {
    notices_.once("rough mirrors with a specular_reflectance are rendered as metal of a principled material");
    PrincipledMaterial kind;
    kind.base_color = factor;
    kind.metallic = 1;
    kind.roughness = metal.roughness;
    kind.anisotropy = metal.anisotropy;
    out.kind = kind;
  } else {
    require_one(from, "specular_reflectance");
  }
}

/// Mitsuba's diffuse part is ρ T(wi) T(wo) / (π η² (1 − F)), and that of a principled material
/// ρ (1 − E(wi)) (1 − E(wo)) / (π (1 − E_mean)). Both are equally bright in uniform light.
void MitsubaMaterials::set_base_below_rough_coat(const MitsubaObject& from, const TexturedColor& albedo, double alpha,
                                                 PrincipledMaterial& out) {
  constexpr std::size_t kMaxCoats = 1000;  // computing one takes time
  const bool beckmann = has_beckmann_facets(from);
  const double ior = out.ior;
  const auto [found, added] = coats_.try_emplace({ior, alpha, beckmann});
  if (coats_.size() > kMaxCoats) {
    from.fail("alpha", fmt::format("at most {} different rough plastics can be rendered", kMaxCoats));
    return;
  }
  RoughCoat& coat = found->second;
  if (added) {
    coat = rough_coat(ior, alpha, beckmann ? CoatFacets::beckmann : CoatFacets::ggx);
  }
  const bool nonlinear = from.boolean("nonlinear", false);
  const auto below = [&](double rho) {
    const double seen = rho * coat.enters * coat.enters /
                        (ior * ior * (1 - (nonlinear ? rho : 1) * coat.reflects_inside) * (1 - coat.reflects));
    return seen >= 0 && seen < rho ? seen : rho;
  };
  set_base_color(out, albedo, below, nonlinear ? coat.reflects_inside : 0);
}

/// A smooth coat is that of a principled material. If it is nonlinear, ρ is the albedo below the coat.
void MitsubaMaterials::plastic(const MitsubaObject& from, Material& out) {
  notices_.once("plastic is rendered as a principled material with the same albedo");
  PrincipledMaterial kind;
  kind.ior = textures_.ior(from, "polypropylene");
  kind.roughness = roughness(from);
  const TexturedColor albedo = textures_.color(from, "diffuse_reflectance", {0.5f, 0.5f, 0.5f});
  kind.base_color = albedo;
  if (kind.roughness > 0) {
    const double alpha = kind.roughness * kind.roughness / (has_beckmann_facets(from) ? kBeckmannToGgx : 1);
    set_base_below_rough_coat(from, albedo, alpha, kind);
    out.single_scattering = true;
  } else if (from.boolean("nonlinear", false)) {
    const double inner = inner_reflectance(kind.ior);
    set_base_color(
        kind, albedo, [&](double rho) { return below_coat(rho, inner); }, inner);
  }
  if (const TexturedColor factor = textures_.color(from, "specular_reflectance", {1, 1, 1});
      !(factor == TexturedColor(1, 1, 1))) {
    notices_.once(
        "the specular_reflectance of plastic also brightens the part below, and colours light along the normal only");
    const float most = std::max({factor.rgb.r, factor.rgb.g, factor.rgb.b});
    kind.specular *= static_cast<double>(most);
    kind.specular_color = factor;
    if (most > 0) {
      kind.specular_color.rgb = {factor.rgb.r / most, factor.rgb.g / most, factor.rgb.b / most};
    }
  }
  out.kind = kind;
}

void MitsubaMaterials::principled(const MitsubaObject& from, MitsubaSurface& out) {
  notices_.once("principled materials are rendered as Lightmill's");
  PrincipledMaterial kind;
  const auto share = [&](std::string_view name, double fallback, ScalarMap* map) -> double {
    const TexturedColor value = textures_.number(from, name, fallback, 0, 1);
    if (value.texture != kNoTexture && map == nullptr) {
      from.fail(name, "textures cannot be rendered here");
    } else if (value.texture != kNoTexture) {
      map->texture = value.texture;
    }
    return value.rgb.r;
  };
  kind.base_color = textures_.color(from, "base_color", {0.5f, 0.5f, 0.5f});
  kind.roughness = share("roughness", 0.5, &out.material.roughness_map);
  kind.metallic = share("metallic", 0, &out.material.metallic_map);
  kind.transmission = share("spec_trans", 0, &kind.transmission_map);
  const double specular = share("specular", 0.5, nullptr);
  if (from.has("specular") && from.has("eta")) {
    from.fail("eta", "cannot be given together with specular");
  }
  // The index whose reflectance at normal incidence is 0.08 specular.
  kind.ior = from.number("eta", 2 / (1 - std::sqrt(0.08 * specular)) - 1, 1e-3, kMaxIor);
  kind.coat = share("clearcoat", 0, &kind.coat_map) / 4;
  const double gloss = share("clearcoat_gloss", 0, nullptr);
  kind.coat_roughness = std::sqrt(0.1 + (0.001 - 0.1) * gloss);
  kind.burley_diffuse = true;
  set_anisotropy(share("anisotropic", 0, nullptr), out, kind);
  for (const std::string_view left : {"spec_tint", "sheen", "flatness"}) {
    if (share(left, 0, nullptr) > 0) {
      notices_.left_out(fmt::format("{} of principled materials", left));
    }
  }
  from.ignore(
      {"sheen_tint", "diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"});
  out.one_sided = kind.transmission == 0;
  out.material.kind = kind;
}

/// Mitsuba's alphas are roughness²/aspect and roughness² · aspect, with aspect = √(1 − 0.9 strength).
void MitsubaMaterials::set_anisotropy(double strength, const MitsubaSurface& surface, PrincipledMaterial& out) {
  if (strength == 0) {
    return;
  }
  if (out.transmission > 0) {
    notices_.left_out("anisotropic of principled materials that transmit light");
    return;
  }
  if (surface.material.roughness_map.texture != kNoTexture) {
    notices_.once("where a texture makes an anisotropic material smoother, its highlights are longer than in Mitsuba");
  }
  const double aspect = std::sqrt(1 - 0.9 * strength), alpha = out.roughness * out.roughness;
  if (alpha > aspect) {
    notices_.once("an alpha of anisotropic materials that is above 1 counts as 1");
  }
  const RoughAxes axes = rough_axes(std::min(alpha / aspect, 1.0), alpha * aspect);
  out.roughness = axes.roughness;
  out.anisotropy = axes.anisotropy;
}

Result<Medium> MitsubaMaterials::medium(const MitsubaObject& from) {
  if (const auto known = media_.find(&from); known != media_.end()) {
    return known->second;
  }
  if (from.type != "homogeneous") {
    return from.place.error("media of the type \"{}\" cannot be rendered", from.type);
  }
  const double scale = from.number("scale", 1, 0, 1e20);
  const RgbColor extinction = textures_.coefficient(from, "sigma_t", 1, 1e20),
                 albedo = textures_.coefficient(from, "albedo", 0.75, 1);
  from.ignore({"sample_emitters", "has_spectral_extinction"});
  Medium out;
  const auto part = [&](float total, float share) {
    return static_cast<float>(std::min(total * scale * share, kMaxAbsorption));
  };
  out.scattering = {part(extinction.r, albedo.r), part(extinction.g, albedo.g), part(extinction.b, albedo.b)};
  out.absorption = {part(extinction.r, 1 - albedo.r), part(extinction.g, 1 - albedo.g),
                    part(extinction.b, 1 - albedo.b)};
  for (const MitsubaObject* phase : from.nested("phase")) {
    if (phase->type == "hg") {
      out.anisotropy = phase->number("g", 0.8, -1, 1);
    } else if (phase->type != "isotropic") {
      return phase->place.error("phase functions of the type \"{}\" cannot be rendered", phase->type);
    }
    LM_RETURN_IF_ERROR(phase->finish(faults_));
  }
  if (std::abs(out.anisotropy) > kMaxMeanCosine) {
    notices_.once(fmt::format("media with a mean cosine beyond ±{0} have ±{0}", kMaxMeanCosine));
    out.anisotropy = std::clamp(out.anisotropy, -kMaxMeanCosine, kMaxMeanCosine);
  }
  LM_RETURN_IF_ERROR(from.finish(faults_));
  return media_.emplace(&from, out).first->second;
}

}  // namespace lightmill
