// Passes of `vcm`: light paths, for connection and merging with camera paths.
#pragma once

#include "common/methods/photons/photon_passes.h"
#include "common/methods/vcm/merge_map.h"
#include "common/methods/vcm/weights.h"

namespace lightmill::vcm {

/// A connected light path helps more pixels than a gathered photon. The radius is small, because merging helps few
/// paths and blurs all. So point meters have more of these radii.
inline constexpr photons::PhotonKind kLightPaths{
    .caustic = false, .pixels_per_photon = 4, .radius = 0.5, .meter_radius = 12, .splats = true, .gathers_near = false};

/// Light vertices are photons, also at casters.
struct LightPathPass : photons::PhotonPass {
  MergeRadii merging;
  std::vector<float> d_vcm, d_vc;           ///< Partial8 by photon
  std::vector<std::uint32_t> path_first;    ///< first entry of `path_photons` by path, and the end
  std::vector<std::uint32_t> path_photons;  ///< photon numbers by path, in the order of scattering
  MergeMap merge_map;                       ///< of all photons

  void trace(const CompiledScene& scene, const photons::PhotonSource& source, RenderCounters& counters,
             const std::stop_token& stop);
  void index(const CompiledScene& /*scene*/) { merge_map = MergeMap(photons, merging); }
  Partial8 partials(U8 number, M8 lanes) const {
    return {gather(d_vcm.data(), number, lanes), gather(d_vc.data(), number, lanes)};
  }
  /// The merging factor η.
  F8 merging_factor(const V8& p) const { return merging.factor(p, plan.photons); }
  std::uint64_t bytes() const;
};

using LightPathPasses = photons::PhotonPasses<LightPathPass>;

}  // namespace lightmill::vcm
