#include "common/scene/document/material.h"

#include <algorithm>
#include <cmath>

#include "common/base/overloaded.h"

namespace lightmill {

std::vector<const TexturedColor*> colors_of(const Material& material) {
  std::vector<const TexturedColor*> out{&material.emission};
  std::visit(Overloaded{[&](const DiffuseMaterial& m) {
                          out.insert(out.end(), {&m.reflectance, &m.transmittance});
                        },
                        [&](const MirrorMaterial& m) { out.push_back(&m.reflectance); },
                        [&](const PhongMaterial& m) {
                          out.insert(out.end(), {&m.diffuse, &m.specular});
                        },
                        [&](const PrincipledMaterial& m) {
                          out.insert(out.end(), {&m.base_color, &m.sheen_color, &m.transmittance, &m.specular_color});
                        },
                        [&](const MixtureMaterial& m) {
                          for (const Material* part : {m.first.get(), m.second.get()}) {
                            const std::vector<const TexturedColor*> colors = colors_of(*part);
                            out.insert(out.end(), colors.begin(), colors.end());
                          }
                        },
                        [](const OneOf<DielectricMaterial, ConductorMaterial, ShadowCatcherMaterial> auto&) {}},
             material.kind);
  return out;
}

std::size_t count_parts(const Material& material) {
  std::size_t count = 0;
  for_each_part(material, [&](const Material&) { ++count; });
  return count;
}

bool has_maps(const Material& material) {
  if (const auto* mixture = std::get_if<MixtureMaterial>(&material.kind)) {
    return mixture->map.texture != kNoTexture || has_maps(*mixture->first) || has_maps(*mixture->second);
  }
  const auto given = [](const ScalarMap& map) { return map.texture != kNoTexture; };
  const auto* const m = std::get_if<PrincipledMaterial>(&material.kind);
  return given(material.roughness_map) || given(material.metallic_map) ||
         (m != nullptr && (given(m->specular_map) || given(m->transmission_map) || given(m->coat_map) ||
                           given(m->coat_roughness_map) || given(m->sheen_roughness_map)));
}

std::optional<double> uniform_opacity(const Opacity& opacity) {
  if (opacity.mode == Opacity::Mode::opaque) {
    return 1;
  }
  if (opacity.map.texture != kNoTexture) {
    return std::nullopt;
  }
  return opacity.mode == Opacity::Mode::blend ? opacity.value : opacity.value >= opacity.cutoff ? 1 : 0;
}

bool is_sheet(const Material& material) {
  return any_part(material, [](const Material& part) {
    if (const auto* principled = std::get_if<PrincipledMaterial>(&part.kind)) {
      const bool diffuse =
          principled->least_transmission() < 1 && (principled->metallic < 1 || part.metallic_map.texture != kNoTexture);
      return diffuse && !is_black(principled->transmittance);
    }
    const auto* diffuse = std::get_if<DiffuseMaterial>(&part.kind);
    return diffuse != nullptr && !is_black(diffuse->transmittance);
  });
}

bool is_glass(const Material& material) {
  return std::visit(Overloaded{[](const DielectricMaterial&) { return true; },
                               [&](const PrincipledMaterial& m) {
                                 return m.transmission > 0 &&
                                        (m.metallic < 1 || material.metallic_map.texture != kNoTexture);
                               },
                               [](const MixtureMaterial& m) { return is_glass(*m.first) || is_glass(*m.second); },
                               [](const OneOf<DiffuseMaterial, MirrorMaterial, PhongMaterial, ConductorMaterial,
                                              ShadowCatcherMaterial> auto&) { return false; }},
                    material.kind);
}

bool is_boundary(const Material& material) {
  return is_glass(material) || (material.interior != Medium{} && is_sheet(material));
}

double ior_of(const Material& material) {
  return std::visit(
      Overloaded{[](const OneOf<DielectricMaterial, PrincipledMaterial> auto& m) { return m.ior; },
                 [](const MixtureMaterial& m) {
                   return is_glass(*m.first) ? ior_of(*m.first) : is_glass(*m.second) ? ior_of(*m.second) : 1.0;
                 },
                 [](const OneOf<DiffuseMaterial, MirrorMaterial, PhongMaterial, ConductorMaterial,
                                ShadowCatcherMaterial> auto&) { return 1.0; }},
      material.kind);
}

double inner_ior(const Material& material) {
  return is_glass(material) ? ior_of(material) : 1;
}

const Anisotropy* anisotropy_of(const Material& material) {
  using None = const Anisotropy*;
  return std::visit(Overloaded{[](const OneOf<ConductorMaterial, PrincipledMaterial> auto& m) { return &m.anisotropy; },
                               [](const OneOf<DiffuseMaterial, MirrorMaterial, DielectricMaterial, PhongMaterial,
                                              ShadowCatcherMaterial, MixtureMaterial> auto&) { return None(nullptr); }},
                    material.kind);
}

double mean_roughness(double roughness, const Anisotropy& anisotropy) {
  const double alpha = roughness * roughness;
  const double along = alpha + (1 - alpha) * anisotropy.strength * anisotropy.strength;
  return anisotropy.strength > 0 ? std::pow(std::max(alpha, kMinAnisotropicAlpha) * along, 0.25) : roughness;
}

RgbColor absorption_of_color(const RgbColor& color) {
  const auto absorption = [](float value) {
    return value > 0 ? static_cast<float>(std::min(1.0 / value - 1.0, kMaxAbsorption))
                     : static_cast<float>(kMaxAbsorption);
  };
  return {absorption(color.r), absorption(color.g), absorption(color.b)};
}

}  // namespace lightmill
