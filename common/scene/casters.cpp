#include "common/scene/casters.h"

#include <cmath>

#include "common/base/overloaded.h"
#include "common/materials/ggx.h"

namespace lightmill {
namespace {

/// The lobes of a material that have an α, and whether there is anything beside them.
struct Lobes {
  std::array<double, 2> alphas{};
  int count = 0;
  bool diffuse = false;
  bool mapped = false;  ///< by a roughness map: the first of them

  void add(double roughness) { alphas[static_cast<std::size_t>(count++)] = roughness * roughness; }
  /// How many have an α below this.
  int below(double alpha) const {
    int n = 0;
    for (int i = 0; i < count; ++i) {
      // As the renderer has it: in single precision, and mapped lobes have a density but where the map says otherwise.
      n += static_cast<float>(alphas[static_cast<std::size_t>(i)]) < static_cast<float>(alpha) && !(mapped && i == 0);
    }
    return n;
  }
};

bool is_black(const TexturedColor& color) {
  return color.rgb == RgbColor{};
}

Lobes lobes_of(const PrincipledMaterial& m, const Material& material) {
  const bool metallic_map = material.metallic_map.texture != kNoTexture;
  const bool all_metal = m.metallic >= 1 && !metallic_map;
  Lobes lobes;
  lobes.diffuse = !all_metal && m.transmission < 1 && !is_black(m.base_color);
  const bool gloss = !all_metal && m.transmission < 1 && m.specular > 0;
  const bool metal = m.metallic > 0;  // also a black one, at grazing angles
  const bool glass = !all_metal && m.transmission > 0;
  if (gloss || metal || glass) {
    lobes.add(m.roughness);
    lobes.mapped = material.roughness_map.texture != kNoTexture;
  }
  if (m.coat > 0) {
    lobes.add(m.coat_roughness);
  }
  return lobes;
}

Lobes lobes_of(const Material& material) {
  Lobes lobes;
  std::visit(
      Overloaded{[&](const DiffuseMaterial& m) { lobes.diffuse = !is_black(m.reflectance); },
                 [&](const MirrorMaterial& m) {
                   if (!is_black(m.reflectance)) {
                     lobes.add(0);
                   }
                 },
                 [&](const DielectricMaterial& m) {
                   // Nearly no refraction is as narrow as none: see RoughDielectric8.
                   lobes.add(m.roughness * m.roughness * std::abs(m.ior - 1) < 1e-5 ? 0 : m.roughness);
                   lobes.mapped = material.roughness_map.texture != kNoTexture && m.roughness > 0;
                 },
                 [&](const PhongMaterial& m) {
                   lobes.diffuse = !is_black(m.diffuse);
                   if (!is_black(m.specular)) {
                     // The widths of their peaks are equal; no exponent is a delta lobe.
                     lobes.add(std::pow(2 / (m.exponent + 2), 0.25));
                   }
                 },
                 [&](const ConductorMaterial& m) {
                   lobes.add(m.roughness);
                   lobes.mapped = material.roughness_map.texture != kNoTexture && m.roughness > 0;
                 },
                 [&](const PrincipledMaterial& m) { lobes = lobes_of(m, material); }, [](const HoldoutMaterial&) {}},
      material.kind);
  return lobes;
}

}  // namespace

bool is_caster(const Material& material) {
  const auto narrow = [](double roughness) { return roughness * roughness < kCasterAlpha; };
  return std::visit(Overloaded{[](const MirrorMaterial&) { return true; },
                               [&](const DielectricMaterial& m) { return narrow(m.roughness); },
                               [&](const ConductorMaterial& m) { return narrow(m.roughness); },
                               [&](const PrincipledMaterial& m) {
                                 const bool metal = m.metallic == 1 && material.metallic_map.texture == kNoTexture;
                                 return (metal || m.transmission == 1) && narrow(m.roughness) &&
                                        (m.coat == 0 || narrow(m.coat_roughness));
                               },
                               [](const auto&) { return false; }},
                    material.kind);
}

std::vector<CasterLobe> caster_lobes(const Material& material) {
  constexpr double kFromTheSide = 0.59;  // 1/√2.86: see the header
  constexpr double kCoatReflects = 0.13;
  const bool mapped = material.roughness_map.texture != kNoTexture;
  const auto alpha = [&](double roughness) { return mapped ? 0 : roughness * roughness; };
  const auto reflected = [&](double roughness) { return alpha(roughness) * kFromTheSide; };
  const auto refracted = [&](double roughness, double ior) { return alpha(roughness) * std::abs(ior - 1); };
  using Lobes = std::vector<CasterLobe>;
  return std::visit(
      Overloaded{[&](const DielectricMaterial& m) {
                   return Lobes{{1, refracted(m.roughness, m.ior)}};
                 },
                 [&](const ConductorMaterial& m) {
                   return Lobes{{1, reflected(m.roughness)}};
                 },
                 [&](const PrincipledMaterial& m) {
                   const double base = m.metallic == 1 ? reflected(m.roughness) : refracted(m.roughness, m.ior);
                   const double coat = kCoatReflects * m.coat;
                   return Lobes{{1 - coat, base}, {coat, m.coat_roughness * m.coat_roughness * kFromTheSide}};
                 },
                 [](const auto&) {
                   return Lobes{{1, 0}};
                 }},
      material.kind);
}

NarrowLobes narrow_lobes(const Material& material) {
  Lobes lobes = lobes_of(material);
  if (lobes.mapped && is_caster(material)) {
    lobes.alphas[0] = 0;
    lobes.mapped = false;
  }
  const int narrow = lobes.below(kNarrowAlpha);
  if (narrow == 0) {
    return NarrowLobes::none;
  }
  return narrow == lobes.count && !lobes.diffuse ? NarrowLobes::all : NarrowLobes::some;
}

bool receives_light(const Material& material) {
  const Lobes lobes = lobes_of(material);
  return lobes.diffuse || lobes.below(ggx::kSmoothAlpha) < lobes.count;
}

}  // namespace lightmill
