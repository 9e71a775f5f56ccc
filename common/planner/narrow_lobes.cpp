#include "common/planner/narrow_lobes.h"

#include <array>
#include <cmath>

#include "common/base/overloaded.h"
#include "common/materials/ggx.h"
#include "common/scene/casters.h"

namespace lightmill {
namespace {

/// The lobes of a material with an alpha, and whether there are others.
struct Lobes {
  std::array<double, 2> alphas{};
  int count = 0;
  bool diffuse = false;
  std::array<bool, 2> mapped{};  ///< its roughness has a map

  void add(double roughness, bool has_map = false) {
    const auto i = static_cast<std::size_t>(count++);
    alphas[i] = roughness * roughness;
    mapped[i] = has_map;
  }
  /// The number of lobes below this alpha.
  int below(double alpha) const {
    int n = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      // In single precision, as in the renderer. Mapped lobes count as having a density.
      n += static_cast<float>(alphas[i]) < static_cast<float>(alpha) && !mapped[i];
    }
    return n;
  }
};

Lobes lobes_of(const PrincipledMaterial& m, const Material& material) {
  const bool metallic_map = material.metallic_map.texture != kNoTexture;
  const bool all_metal = m.metallic >= 1 && !metallic_map;
  Lobes lobes;
  const bool plastic = m.least_transmission() < 1;
  const bool sheen = !is_black(m.sheen_color) && (plastic || m.metallic > 0);
  lobes.diffuse = (!all_metal && plastic && !(is_black(m.base_color) && is_black(m.transmittance))) || sheen;
  const bool gloss = !all_metal && plastic && m.specular > 0;
  const bool metal = m.metallic > 0;  // also a black one, at grazing angles
  const bool glass = !all_metal && m.transmission > 0;
  if (gloss || metal || glass) {
    lobes.add(gloss || metal ? mean_roughness(m.roughness, m.anisotropy) : m.roughness,
              material.roughness_map.texture != kNoTexture);
  }
  if (m.coat > 0) {
    lobes.add(m.coat_roughness, m.coat_roughness_map.texture != kNoTexture);
  }
  return lobes;
}

Lobes lobes_of(const Material& material) {
  Lobes lobes;
  std::visit(Overloaded{[&](const DiffuseMaterial& m) {
                          lobes.diffuse = !is_black(m.reflectance) || !is_black(m.transmittance);
                        },
                        [&](const MirrorMaterial& m) {
                          if (!is_black(m.reflectance)) {
                            lobes.add(0);
                          }
                        },
                        [&](const DielectricMaterial& m) {
                          // With an index near 1 the lobe is so narrow that it counts as a delta (see RoughDielectric8).
                          lobes.add(m.roughness * m.roughness * std::abs(m.ior - 1) < 1e-5 ? 0 : m.roughness,
                                    material.roughness_map.texture != kNoTexture && m.roughness > 0);
                        },
                        [&](const PhongMaterial& m) {
                          lobes.diffuse = !is_black(m.diffuse);
                          if (!is_black(m.specular)) {
                            // Gives the peak of equal width. No exponent is a delta lobe.
                            lobes.add(std::pow(2 / (m.exponent + 2), 0.25));
                          }
                        },
                        [&](const ConductorMaterial& m) {
                          lobes.add(mean_roughness(m.roughness, m.anisotropy),
                                    material.roughness_map.texture != kNoTexture && m.roughness > 0);
                        },
                        [&](const PrincipledMaterial& m) { lobes = lobes_of(m, material); },
                        [](const OneOf<ShadowCatcherMaterial, MixtureMaterial> auto&) {}},
             material.kind);
  return lobes;
}

}  // namespace

NarrowLobes narrow_lobes(const Material& material) {
  if (const auto* mixture = std::get_if<MixtureMaterial>(&material.kind)) {
    const NarrowLobes first = narrow_lobes(*mixture->first), second = narrow_lobes(*mixture->second);
    return first == second ? first : NarrowLobes::some;
  }
  Lobes lobes = lobes_of(material);
  for (std::size_t i = 0; i < lobes.mapped.size() && is_caster(material); ++i) {
    if (lobes.mapped[i]) {
      lobes.alphas[i] = 0;
      lobes.mapped[i] = false;
    }
  }
  const int narrow = lobes.below(kNarrowAlpha);
  if (narrow == 0) {
    return NarrowLobes::none;
  }
  return narrow == lobes.count && !lobes.diffuse ? NarrowLobes::all : NarrowLobes::some;
}

bool receives_light(const Material& material) {
  return any_part(material, [](const Material& part) {
    const Lobes lobes = lobes_of(part);
    return lobes.diffuse || lobes.below(ggx::kSmoothAlpha) < lobes.count;
  });
}

}  // namespace lightmill
