#include "common/scene_io/pbrt/pbrt_materials.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/scene/document/subsurface.h"
#include "common/scene_io/coat.h"
#include "common/scene_io/measured_media.h"
#include "common/scene_io/mixing.h"
#include "common/scene_io/rough_axes.h"
#include "common/scene_io/thin_glass.h"

namespace lightmill {
namespace {

/// Reflectance at normal incidence of a metal in a medium of this index.
float normal_reflectance(float n, float k, double ior) {
  const double a = n / ior, b = k / ior;
  return static_cast<float>(((a - 1) * (a - 1) + b * b) / ((a + 1) * (a + 1) + b * b));
}

RgbColor each(const RgbColor& c, const std::function<double(double)>& f) {
  return {static_cast<float>(f(c.r)), static_cast<float>(f(c.g)), static_cast<float>(f(c.b))};
}

constexpr double kLargestScale = 1e20;  ///< of a medium's coefficients

/// The medium that this parameter names, per millimetre. Reports a name that is unknown.
Medium named_medium(const PbrtParameters& from, const std::string& parameter) {
  const std::string name = from.text(parameter, "");
  const std::optional<Medium> found = measured_medium(name);
  if (!found) {
    from.fail(parameter, fmt::format("there is no measured medium \"{}\": give sigma_a and sigma_s instead", name));
  }
  return found.value_or(Medium{});
}

/// The medium with its coefficients times a factor of 0 or more, up to what media can have.
Medium scaled(Medium medium, double factor) {
  for (RgbColor* const color : {&medium.absorption, &medium.scattering}) {
    *color = each(*color, [&](double sigma) { return std::min(sigma * factor, kMaxAbsorption); });
  }
  return medium;
}

/// The medium whose thick bodies, without a refracting surface, return what this one returns below a smooth surface.
Medium below_surface(Medium medium, double ior) {
  for (const auto channel : {&RgbColor::r, &RgbColor::g, &RgbColor::b}) {
    const double extinction = double{medium.absorption.*channel} + medium.scattering.*channel;
    const double albedo = extinction > 0 ? medium.scattering.*channel / extinction : 0;
    const auto share = static_cast<float>(returned_share(albedo, medium.anisotropy));
    const double below = below_coat(share, inner_reflectance(ior));
    const double scattering = extinction * scattering_albedo(below, medium.anisotropy);
    medium.scattering.*channel = static_cast<float>(scattering);
    medium.absorption.*channel = static_cast<float>(extinction - scattering);
  }
  return medium;
}

TexturedColor textured(const PbrtValue& value) {
  return {value.color, value.texture};
}

}  // namespace

PbrtMaterials::PbrtMaterials(PbrtSpectra& spectra, PbrtTextures& textures, Notices& notices, Faults& faults)
    : spectra_(spectra), textures_(textures), notices_(notices), faults_(faults) {
  define("diffuse", PbrtParameters({}, {}, "Material diffuse"));
  definitions_[kDefault].name = "default";
}

std::size_t PbrtMaterials::define(std::string type, PbrtParameters from) {
  type = type.empty() || type == "none" ? "interface" : type;
  std::string name = fmt::format("{} of line {}", type, from.place().line);
  definitions_.push_back({std::move(type), std::move(name), std::move(from), std::nullopt});
  return definitions_.size() - 1;
}

Status PbrtMaterials::define_named(const std::string& name, PbrtParameters from) {
  if (by_name_.contains(name)) {
    return from.place().error("there are two materials \"{}\"", name);
  }
  std::string type = from.text("type", "");
  const std::size_t number = define(std::move(type), std::move(from));
  definitions_[number].name = name;
  by_name_.emplace(name, number);
  return ok_status();
}

Result<std::size_t> PbrtMaterials::named(const std::string& name, const SourcePlace& place) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? Result<std::size_t>(place.error("there is no material \"{}\"", name))
                                 : found->second;
}

bool PbrtMaterials::is_plain(std::size_t number) const {
  const PbrtParameters& from = definitions_[number].from;
  const std::string& type = definitions_[number].type;
  if (type == "mix" || from.has_texture() || from.has("normalmap")) {
    return false;
  }
  const auto directed = [&](const std::string& prefix) {
    const auto [u, v] = alphas(from, prefix);
    return u != v;
  };
  return type == "conductor" ? !directed("") : type != "coatedconductor" || !directed("conductor.");
}

Result<Material> PbrtMaterials::convert(std::size_t number) {
  Definition& definition = definitions_[number];
  if (!definition.converted) {
    Material out;
    if (definition.type == "mix") {
      LM_ASSIGN_OR_RETURN(out, mixed(definition));
    } else {
      set_kind(definition.type, definition.from, out);
      set_relief(definition.from, out);
    }
    out.name = definition.name;
    LM_RETURN_IF_ERROR(definition.from.finish(faults_));
    definition.converted = std::move(out);
  }
  return *definition.converted;
}

Result<Material> PbrtMaterials::mixed(const Definition& definition) {
  constexpr int kMaxMixtures = 100;
  const PbrtParameters& from = definition.from;
  const std::vector<std::string> names = from.strings("materials");
  const PbrtValue amount = textures_.number(from, "amount", 0.5);
  if (names.size() != 2) {
    return from.place().error("a mixture needs two materials, got {}", names.size());
  }
  if (mixing_ == kMaxMixtures) {
    return from.place().error("mixtures are nested more than {} deep", kMaxMixtures);
  }
  const float t = std::clamp(amount.color.r, 0.0f, 1.0f);
  const bool textured = amount.varies() && t > 0;
  std::array<Material, 2> parts;
  ++mixing_;
  for (std::size_t i = 0; i < 2; ++i) {
    LM_ASSIGN_OR_RETURN(const std::size_t number, named(names[i], from.place()));
    if (textured || (i == 0 ? t < 1 : t > 0)) {
      LM_ASSIGN_OR_RETURN(parts[i], convert(number));
    }
  }
  --mixing_;
  if (!textured && (t == 0 || t == 1)) {
    return parts[t == 0 ? 0 : 1];
  }
  const Medium none, &first = parts[0].interior, &second = parts[1].interior;
  if (first != none && second != none && first != second) {
    return from.place().error("a mixture of two subsurface media cannot be rendered");
  }
  Result<Material> out = lightmill::mixed(parts[0], parts[1], t, {amount.texture}, notices_);
  if (!out.ok()) {
    return from.place().error("{}", message_of(out.status()));
  }
  out->interior = first == none ? second : first;
  return out;
}

void PbrtMaterials::set_kind(const std::string& type, const PbrtParameters& from, Material& out) {
  out.single_scattering = true;
  if (type == "diffuse") {
    out.single_scattering = false;
    out.kind = DiffuseMaterial{textured(textures_.color(from, "reflectance", {0.5f, 0.5f, 0.5f}))};
  } else if (type == "diffusetransmission") {
    out.single_scattering = false;
    DiffuseMaterial sheet;
    const double scale = from.number("scale", 1, 0, 1);
    for (const auto& [name, color] :
         {std::pair{"reflectance", &sheet.reflectance}, {"transmittance", &sheet.transmittance}}) {
      *color = textured(textures_.color(from, name, {0.25f, 0.25f, 0.25f}));
      color->rgb = each(color->rgb, [&](double c) { return c * scale; });
    }
    out.kind = sheet;
  } else if (type == "thindielectric") {
    notices_.once("thindielectric reflects the same share at all angles: that of light along the normal");
    out = thin_glass(spectra_.ior(from, "eta", 1.5));
  } else if (type == "interface") {
    out.kind = DielectricMaterial{1, 0};
  } else if (type == "dielectric") {
    const PbrtParameter* eta = from.find("eta");
    if (eta != nullptr && eta->type == "spectrum") {
      notices_.left_out("dispersion: glass has its index of refraction at 587.6 nm");
    }
    out.kind = DielectricMaterial{spectra_.ior(from, "eta", 1.5), roughness(from, "")};
  } else if (type == "subsurface") {
    subsurface(from, out);
  } else if (type == "conductor") {
    out.kind = conductor(from, "");
    if (const PbrtParameter* reflectance = from.find("reflectance");
        reflectance != nullptr && reflectance->type == "texture") {
      notices_.once("conductors with a textured reflectance are rendered as metal of a principled material");
      PrincipledMaterial metal;
      metal.base_color = textured(textures_.color(from, "reflectance", {1, 1, 1}));
      metal.metallic = 1;
      metal.roughness = std::get<ConductorMaterial>(out.kind).roughness;
      metal.anisotropy = std::get<ConductorMaterial>(out.kind).anisotropy;
      out.kind = metal;
    }
  } else if (type == "coateddiffuse") {
    coated_diffuse(from, out);
  } else if (type == "coatedconductor") {
    coated_conductor(from, out);
  } else {
    from.fail(from.place().error("materials of the type \"{}\" cannot be rendered", type));
  }
}

ConductorMaterial PbrtMaterials::conductor(const PbrtParameters& from, const std::string& prefix) {
  ConductorMaterial out;
  const auto [u, v] = alphas(from, prefix);
  const RoughAxes axes = rough_axes(u, v);
  out.roughness = axes.roughness;
  out.anisotropy = axes.anisotropy;
  const std::string eta = prefix + "eta", k = prefix + "k";
  if (const PbrtParameter* reflectance = from.find("reflectance"); reflectance != nullptr) {
    if (from.has(eta) || from.has(k)) {
      from.fail("reflectance", "cannot be given together with eta and k");
    }
    if (reflectance->type != "texture") {
      out.eta = {1, 1, 1};
      out.k = each(spectra_.reflectance(from, "reflectance").value_or(RgbColor{1, 1, 1}), [](double r) {
        r = std::min(r, 0.9999);  // as pbrt does
        return 2 * std::sqrt(r) / std::sqrt(1 - r);
      });
    }
    return out;
  }
  const Metal copper = find_metal("copper").value();
  out.eta = spectra_.metal(from, eta, "eta").value_or(RgbColor{copper.eta[0], copper.eta[1], copper.eta[2]});
  out.k = spectra_.metal(from, k, "k").value_or(RgbColor{copper.k[0], copper.k[1], copper.k[2]});
  if (const std::optional<PbrtSpectra::Indices> measured = spectra_.measured_metal(from, eta, k)) {
    out.eta = measured->eta;
    out.k = measured->k;
  }
  const auto nothing = [](float n, float absorbed) { return n == 0 && absorbed == 0; };
  if (nothing(out.eta.r, out.k.r) || nothing(out.eta.g, out.k.g) || nothing(out.eta.b, out.k.b)) {
    from.fail(eta, "eta and k must not both be 0 at 650, 550 or 450 nm");
    out = {};
  }
  return out;
}

/// A sheet below gloss. It does not refract, so that all light of all emitters is found. Its medium has the extinction of
/// pbrt's, and the colour of pbrt's below the surface: light that leaves is partly reflected back inside.
void PbrtMaterials::subsurface(const PbrtParameters& from, Material& out) {
  constexpr double kShortest = 1e-6;
  notices_.once("subsurface materials are rendered as a principled sheet around a medium of their colour");
  out.single_scattering = false;
  const double scale = from.number("scale", 1, 0, kLargestScale), ior = spectra_.ior(from, "eta", 1.33);
  PrincipledMaterial sheet;
  sheet.base_color = {0, 0, 0};
  sheet.transmittance = {1, 1, 1};
  sheet.roughness = roughness(from, "");
  sheet.ior = ior;
  out.kind = sheet;
  const double g = from.number("g", 0, -kMaxMeanCosine, kMaxMeanCosine);
  const bool named = !from.text("name", "").empty();
  if (from.has("sigma_a") != from.has("sigma_s")) {
    from.fail(from.has("sigma_a") ? "sigma_a" : "sigma_s", "needs sigma_a and sigma_s together");
  }
  if (from.has("reflectance") && !named && !from.has("sigma_a")) {
    const RgbColor length = spectra_.coefficient(from, "mfp").value_or(RgbColor{1, 1, 1});
    out.interior =
        subsurface_medium(spectra_.reflectance(from, "reflectance").value_or(RgbColor{}),
                          each(length, [&](double l) { return std::max(l * scale / (1 - g), kShortest); }), g);
    return;
  }
  Medium medium = named ? named_medium(from, "name") : measured_medium("Wholemilk").value();  // pbrt's default is milk
  if (!named) {
    medium.absorption = spectra_.coefficient(from, "sigma_a").value_or(medium.absorption);
    medium.scattering = spectra_.coefficient(from, "sigma_s").value_or(medium.scattering);
    medium.anisotropy = g;
  }
  out.interior = below_surface(scaled(medium, scale), ior);
}

/// pbrt follows light between a coat and the surface below it for `maxdepth` steps. Each crossing of the coat takes light
/// away, as of a medium with an extinction of 1. A rough coat loses the light that meets several of its facets. A
/// principled material's diffuse part is ρ (1 − E(wi)) (1 − E(wo)) / (π (1 − E_mean)). Both are equally bright in uniform
/// light.
void PbrtMaterials::set_base_below_coat(const PbrtParameters& from, const TexturedColor& albedo,
                                        PrincipledMaterial& out) {
  constexpr std::size_t kMaxCoats = 1000;  // computing one takes time
  const bool empty = !from.has("albedo");
  const PbrtValue depth = textures_.number(from, "thickness", 0.01);
  const double thickness = empty && !depth.varies() ? std::clamp<double>(depth.color.r, 0, 1e3) : 0;
  const std::int64_t times =
      (from.whole("maxdepth", 10, 0, 1'000'000) + 1) / 2;  // every other step ends below the coat
  const double ior = out.ior, alpha = out.roughness * out.roughness;
  const auto [found, added] = coats_.try_emplace({ior, alpha, thickness});
  if (coats_.size() > kMaxCoats) {
    from.fail("roughness", fmt::format("at most {} different coats can be rendered", kMaxCoats));
    return;
  }
  RoughCoat& coat = found->second;
  if (added) {
    coat = rough_coat(ior, alpha, CoatFacets::ggx_correlated, thickness);
  }
  const auto below = [&](double rho) {
    const double again = rho * coat.reflects_inside;
    const double sum = again < 1 ? (1 - std::pow(again, times)) / (1 - again) : static_cast<double>(times);
    const double seen = rho * coat.enters * coat.enters * sum / (ior * ior * (1 - coat.reflects));
    return seen >= 0 && seen < rho ? seen : rho;
  };
  set_base_color(out, albedo, below, coat.reflects_inside);
}

void PbrtMaterials::coated_diffuse(const PbrtParameters& from, Material& out) {
  notices_.once("coateddiffuse is rendered as a principled material with the same albedo");
  PrincipledMaterial kind;
  kind.ior = spectra_.ior(from, "eta", 1.5);
  kind.roughness = roughness(from, "");
  out.single_scattering = kind.roughness > 0;
  const PbrtValue base = textures_.color(from, "reflectance", {0.5f, 0.5f, 0.5f});
  set_base_below_coat(from, textured(base), kind);
  out.kind = kind;
  if (const PbrtValue medium = textures_.color(from, "albedo", {0, 0, 0}); medium.varies() || !is_black(medium.color)) {
    notices_.left_out("the scattering medium in coats");
  }
  for (const char* unused : {"g", "nsamples"}) {
    from.find(unused);
  }
}

void PbrtMaterials::coated_conductor(const PbrtParameters& from, Material& out) {
  notices_.once("coatedconductor is rendered as coated metal of a principled material");
  out.single_scattering = false;
  const double ior = spectra_.ior(from, "interface.eta", 1.5);
  const ConductorMaterial metal = conductor(from, "conductor.");
  PrincipledMaterial kind;
  kind.metallic = 1;
  kind.roughness = metal.roughness;
  kind.anisotropy = metal.anisotropy;
  kind.coat = 1;
  kind.coat_roughness = roughness(from, "interface.");
  const PbrtParameter* reflectance = from.find("reflectance");
  kind.base_color = reflectance != nullptr ? textured(textures_.color(from, "reflectance", {1, 1, 1}))
                                           : TexturedColor(normal_reflectance(metal.eta.r, metal.k.r, ior),
                                                           normal_reflectance(metal.eta.g, metal.k.g, ior),
                                                           normal_reflectance(metal.eta.b, metal.k.b, ior));
  out.kind = kind;
  for (const char* unused : {"thickness", "g", "albedo", "maxdepth", "nsamples"}) {
    from.find(unused);
  }
}

std::array<double, 2> PbrtMaterials::alphas(const PbrtParameters& from, const std::string& prefix) const {
  const auto value = [&](std::string_view name, double fallback) {
    const PbrtValue read = textures_.number(from, fmt::format("{}{}", prefix, name), fallback);
    if (read.varies()) {
      notices_.left_out("textures of roughness: half of their largest value counts");
    }
    return std::clamp<double>(read.varies() ? read.color.r / 2 : read.color.r, 0, 1);
  };
  const double both = value("roughness", 0), u = value("uroughness", both), v = value("vroughness", both);
  const bool remapped = from.boolean("remaproughness", true);  // then alpha is the square root
  return {remapped ? std::sqrt(u) : u, remapped ? std::sqrt(v) : v};
}

double PbrtMaterials::roughness(const PbrtParameters& from, const std::string& prefix) {
  const auto [u, v] = alphas(from, prefix);
  if (u != v) {
    notices_.once("glass and coats that are rougher along one axis have the mean roughness");
  }
  return std::sqrt(std::sqrt(u * v));
}

void PbrtMaterials::set_relief(const PbrtParameters& from, Material& out) {
  out.normal_map = {textures_.normal_map(from), 1};
  const PbrtValue height = textures_.number(from, "displacement", 0);
  if (height.varies() && out.normal_map.texture == kNoTexture) {
    out.bump_map = {{height.texture}, height.color.r};
  }
}

Status PbrtMedia::define(const std::string& name, const PbrtParameters& from) {
  if (const std::string type = from.text("type", ""); type != "homogeneous") {
    return from.place().error("only homogeneous media can be rendered, got \"{}\"", type);
  }
  Medium out;
  if (!from.text("preset", "").empty()) {
    out = named_medium(from, "preset");
  } else {
    out.absorption = spectra_.coefficient(from, "sigma_a").value_or(RgbColor{1, 1, 1});
    out.scattering = spectra_.coefficient(from, "sigma_s").value_or(RgbColor{1, 1, 1});
  }
  out = scaled(out, from.number("scale", 1, 0, kLargestScale));
  out.anisotropy = from.number("g", 0, -1, 1);
  if (std::abs(out.anisotropy) > kMaxMeanCosine) {
    notices_.once(fmt::format("media with a mean cosine beyond ±{0} have ±{0}", kMaxMeanCosine));
    out.anisotropy = std::clamp(out.anisotropy, -kMaxMeanCosine, kMaxMeanCosine);
  }
  if (const std::optional<RgbColor> light = spectra_.light(from, "Le"); light && !is_black(*light)) {
    from.fail("Le", "media that emit light cannot be rendered");
  }
  from.find("Lescale");
  LM_RETURN_IF_ERROR(from.finish(faults_));
  return media_.try_emplace(name, out).second ? ok_status() : from.place().error("there are two media \"{}\"", name);
}

Result<Medium> PbrtMedia::find(const std::string& name, const SourcePlace& place) const {
  const auto found = media_.find(name);
  return name.empty()            ? Medium{}
         : found != media_.end() ? Result<Medium>(found->second)
                                 : place.error("there is no medium \"{}\"", name);
}

}  // namespace lightmill
