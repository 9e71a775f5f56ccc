// Density of the directions into which media scatter paths.
#pragma once

#include "common/lights/equiangular.h"
#include "common/materials/henyey_greenstein.h"
#include "common/scene/compiled/medium_table.h"

namespace lightmill::tracer {

/// Mixture of the phase function and of directions past lights. Without the latter, a path rarely passes a light so
/// near that its next segment is very bright.
class ScatteredDirections8 {
 public:
  ScatteredDirections8(const EquiangularLights& lights, const MediumTable& media, U8 medium, const V8& point,
                       const V8& wo)
      : phase_{media.anisotropy(medium)}, wo_(wo) {
    const V8 extinction = media.extinction(medium);
    aim_ = lights.aim(point, F8(3.0f) / (extinction.x + extinction.y + extinction.z));
  }

  F8 phase(const V8& wi) const { return phase_.pdf_solid_angle(wo_, wi); }
  F8 pdf_solid_angle(const V8& wi) const { return aim_.rest * phase(wi) + aim_.pdf_solid_angle(wi); }
  V8 sample(Pair8 u) const {
    const M8 aimed = u.u >= aim_.rest;
    const V8 by_phase = phase_.sample(wo_, {min(u.u / aim_.rest, F8(0x1.fffffep-1f)), u.v});
    return aimed.any() ? select(aimed, aim_.sample(u), by_phase) : by_phase;
  }

 private:
  HenyeyGreenstein8 phase_;
  V8 wo_;
  EquiangularLights::Aim8 aim_;
};

}  // namespace lightmill::tracer
