#include "common/scene/casters.h"

#include <cmath>

#include "common/base/overloaded.h"

namespace lightmill {

bool is_caster(const Material& material) {
  const auto narrow = [](double roughness) { return roughness * roughness < kCasterAlpha; };
  const auto receiver = [](const OneOf<DiffuseMaterial, PhongMaterial, ShadowCatcherMaterial> auto&) { return false; };
  return std::visit(
      Overloaded{[](const MirrorMaterial&) { return true; },
                 [&](const DielectricMaterial& m) { return narrow(m.roughness); },
                 [&](const ConductorMaterial& m) { return narrow(mean_roughness(m.roughness, m.anisotropy)); },
                 [&](const PrincipledMaterial& m) {
                   const bool metal = m.metallic == 1 && material.metallic_map.texture == kNoTexture;
                   const bool all_glass = m.least_transmission() == 1;
                   const bool glass = all_glass && m.metallic == 0;
                   const double roughness = glass ? m.roughness : mean_roughness(m.roughness, m.anisotropy);
                   return (metal || all_glass) && (glass || is_black(m.sheen_color)) && narrow(roughness) &&
                          (m.coat == 0 || narrow(m.coat_roughness));
                 },
                 [](const MixtureMaterial& m) { return is_caster(*m.first) || is_caster(*m.second); }, receiver},
      material.kind);
}

std::vector<CasterLobe> caster_lobes(const Material& material) {
  // Light that hits metal at θ spreads over cos θ times the solid angle (Walter et al. 2007, equation 14). For rays
  // that continue beside and below the sphere, cos θ < 0.7, the mean of 1/cos θ is 2.86.
  constexpr double kFromTheSide = 0.59;   // 1/√2.86
  constexpr double kCoatReflects = 0.14;  // of these rays, by Fresnel's equations
  const bool mapped = material.roughness_map.texture != kNoTexture;
  const auto alpha = [&](double roughness) { return mapped ? 0 : roughness * roughness; };
  const auto reflected = [&](double roughness) { return alpha(roughness) * kFromTheSide; };
  // Glass deflects light by |n − 1| times the tilt of its normal, and metal by twice the tilt. Slanted exits spread the
  // light of glass about twice as wide (measured on spheres).
  const auto refracted = [&](double roughness, double ior) { return alpha(roughness) * std::abs(ior - 1); };
  using Lobes = std::vector<CasterLobe>;
  return std::visit(
      Overloaded{[&](const DielectricMaterial& m) {
                   return Lobes{{1, refracted(m.roughness, m.ior)}};
                 },
                 [&](const ConductorMaterial& m) {
                   return Lobes{{1, reflected(mean_roughness(m.roughness, m.anisotropy))}};
                 },
                 [&](const PrincipledMaterial& m) {
                   const double base = m.metallic == 1 ? reflected(mean_roughness(m.roughness, m.anisotropy))
                                                       : refracted(m.roughness, m.ior);
                   const double coat = kCoatReflects * m.coat;
                   const bool smooth_coat = m.coat_roughness_map.texture != kNoTexture;
                   const double of_coat = smooth_coat ? 0 : m.coat_roughness * m.coat_roughness * kFromTheSide;
                   return Lobes{{1 - coat, base}, {coat, of_coat}};
                 },
                 [](const MixtureMaterial& m) {
                   Lobes lobes;
                   const double second = std::clamp(m.factor, 0.01, 0.99);
                   const double first = is_caster(*m.second) ? 1 - second : 1;
                   for (const auto& [part, share] :
                        {std::pair{&*m.first, first}, {&*m.second, is_caster(*m.first) ? second : 1}}) {
                     for (const CasterLobe& lobe : is_caster(*part) ? caster_lobes(*part) : Lobes{}) {
                       lobes.push_back({share * lobe.share, lobe.alpha});
                     }
                   }
                   return lobes;
                 },
                 [](const OneOf<DiffuseMaterial, MirrorMaterial, PhongMaterial, ShadowCatcherMaterial> auto&) {
                   return Lobes{{1, 0}};
                 }},
      material.kind);
}

}  // namespace lightmill
