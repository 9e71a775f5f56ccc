// How much each light sends to each target of photons.
#pragma once

#include <span>
#include <vector>

#include "common/lights/light_table.h"
#include "common/lights/photon_aim.h"

namespace lightmill {

struct PhotonFluxes {
  std::vector<std::uint32_t> lights;  ///< numbers of those that can reach a target, ascending
  std::vector<double> luminance;      ///< [light][target]: of the flux, W
};

/// Estimates by a few points and directions of each light, the same for all; none is less than a sixteenth of what the
/// light's power would send there if it shone equally in all directions, save where it provably sends nothing: then it
/// is 0. Those of lights from infinitely far are exact. `targets` are those of `aim`. An
/// environment that the table does not sample counts where `unsampled` light is wanted.
PhotonFluxes estimate_fluxes(const LightTable& lights, std::span<const BoundingSphere> targets, const PhotonAim& aim,
                             bool unsampled);

}  // namespace lightmill
