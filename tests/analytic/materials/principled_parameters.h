// Principled BSDFs for tests.
#pragma once

#include "common/materials/principled.h"
#include "tests/analytic/materials/bsdf_checks.h"

namespace lightmill::test {

/// Parameters of a principled BSDF, the same in all lanes.
struct Parameters {
  Vec3 base_color{0.8f};
  float metallic = 0, roughness = 0.5f, specular = 0.5f, transmission = 0, ior = 1.5f, coat = 0, coat_roughness = 0.1f;
  bool compensated = true, burley = false;
  float anisotropy = 0;
  Vec3 sheen_color{0};
  float sheen_roughness = 0.5f;
  Vec3 transmittance{0};
  bool closed = false;
  Vec3 specular_color{1};

  PrincipledParameters8 in_lanes() const {
    return {broadcast(base_color),
            F8(metallic),
            F8(roughness),
            F8(specular),
            F8(transmission),
            F8(ior),
            F8(coat),
            F8(coat_roughness),
            M8(compensated),
            M8(burley),
            PrincipledAnisotropy8{F8(anisotropy), M8(true)},
            PrincipledSheen8{broadcast(sheen_color), F8(sheen_roughness)},
            PrincipledSheet8{broadcast(transmittance), M8(closed)},
            broadcast(specular_color)};
  }
  Principled8 seen_from(const V8& wo, M8 front = M8(true)) const {
    return {in_lanes(), select(front, F8(ior), F8(1 / ior)), wo, front};
  }
};

inline const double kPrincipledAngles[] = {0.01, 40, 75, 88};

inline Grid grid_for(const Parameters& p, const Vec3d& wo, double eta) {
  const double roughness = p.coat > 0 ? std::min(p.roughness, p.coat_roughness) : p.roughness;
  return {mirrored(wo), refracted(wo, eta), std::clamp(2.0 * roughness * roughness, 0.05, 0.3)};
}

}  // namespace lightmill::test
