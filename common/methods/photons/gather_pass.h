// Passes of `caustic`, `ppm` and `photon-map`: photons that camera paths gather, or see directly.
#pragma once

#include "common/methods/photons/photon_map.h"
#include "common/methods/photons/photon_passes.h"

namespace lightmill::photons {

inline constexpr float kLaterRadius = 4;  ///< gather radius of later photons over that of first ones
inline constexpr PhotonKind kCausticPhotons{
    .caustic = true, .pixels_per_photon = 16, .radius = 1.5, .meter_radius = kLaterRadius, .splats = true};
inline constexpr PhotonKind kGlobalPhotons{
    .caustic = false, .pixels_per_photon = 16, .radius = 3, .meter_radius = kLaterRadius, .splats = false};

struct GatherPass : PhotonPass {
  PhotonMap first, later;     ///< photons that met only casters before, and others; global photons are all in `first`
  float least = 0, most = 0;  ///< limits of the gather radius in `first`

  void trace(const CompiledScene& scene, const PhotonSource& source, RenderCounters& counters,
             const std::stop_token& stop);
  /// Sets the maps and the limits of gather radii.
  void index(const CompiledScene& scene);
  /// Gather radius in `first`, for camera paths of this length.
  F8 gather_radius(F8 path_length) const {
    return min(max(path_length * F8(plan.radius_per_length), F8(least)), F8(most));
  }
  std::uint64_t bytes() const { return sizeof(GatherPass) + PhotonPass::bytes() + first.bytes() + later.bytes(); }
};

using GatherPasses = PhotonPasses<GatherPass>;

}  // namespace lightmill::photons
