// Passes of `caustic`, `ppm` and `photon-map`: photons that camera paths gather, or see directly.
#pragma once

#include "common/methods/photons/photon_map.h"
#include "common/methods/photons/photon_passes.h"

namespace lightmill::photons {

inline constexpr float kLaterRadius = 4;  ///< gather radius of later photons over that of first ones
inline constexpr PhotonKind kCausticPhotons{.caustic = true,
                                            .pixels_per_photon = 16,
                                            .radius = 1.5,
                                            .meter_radius = kLaterRadius,
                                            .splats = true,
                                            .gathers_near = true};
inline constexpr PhotonKind kGlobalPhotons{.caustic = false,
                                           .pixels_per_photon = 16,
                                           .radius = 3,
                                           .meter_radius = kLaterRadius,
                                           .splats = false,
                                           .gathers_near = false};

struct GatherPass : PhotonPass {
  /// Limits of gather radii.
  struct Radii {
    float least = 0, most = 0;
  };
  PhotonMap first, later;    ///< photons that met only casters before, and others; global photons are all in `first`
  PhotonMap scattered;       ///< photons in media
  Radii radii, media_radii;  ///< in `first` and in `scattered`

  void trace(const CompiledScene& scene, const PhotonSource& source, RenderCounters& counters,
             const std::stop_token& stop);
  /// Sets the maps and the limits of gather radii.
  void index(const CompiledScene& scene);
  /// Gather radius in `first`, for camera paths of this length.
  F8 gather_radius(F8 path_length) const { return limited(path_length * F8(plan.radius_per_length), radii); }
  /// The same in `scattered`, in media of this mean extinction.
  F8 media_radius(F8 path_length, F8 extinction) const {
    return min(limited(path_length * F8(plan.media_radius_per_length), media_radii),
               F8(plan.media_free_paths) / extinction);
  }
  std::uint64_t bytes() const {
    return sizeof(GatherPass) + PhotonPass::bytes() + first.bytes() + later.bytes() + scattered.bytes();
  }

 private:
  static F8 limited(F8 radius, const Radii& radii) { return min(max(radius, F8(radii.least)), F8(radii.most)); }
};

using GatherPasses = PhotonPasses<GatherPass>;

}  // namespace lightmill::photons
