// Estimates of the flux from each light to each photon target.
#pragma once

#include <span>
#include <vector>

#include "common/lights/light_table.h"
#include "common/lights/photon_aim.h"

namespace lightmill {

struct PhotonFluxes {
  std::vector<std::uint32_t> lights;  ///< numbers of the lights that can reach a target, ascending
  std::vector<double> luminance;      ///< [light][target]: luminance of the flux, W
};

/// Estimates by a few points and directions of each light, the same for all. An estimate is at least a sixteenth of the
/// flux from an isotropic light of the same power. It is 0 if the light provably sends nothing. Estimates of distant
/// lights are exact. `targets`: those of `aim`. `unsampled`: whether an environment that the table does not sample also
/// emits photons.
PhotonFluxes estimate_fluxes(const LightTable& lights, std::span<const BoundingSphere> targets, const PhotonAim& aim,
                             bool unsampled);

}  // namespace lightmill
