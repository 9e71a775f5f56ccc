// Photon tracing: the photons of one pass, from their lights to the surfaces that store them.
#pragma once

#include <vector>

#include "common/lights/photon_emission.h"
#include "common/methods/method.h"
#include "common/methods/photons/merge_map.h"
#include "common/methods/photons/photon.h"

namespace lightmill::photons {

/// A photon that has crossed a meter.
struct MeterHit {
  std::uint32_t pixel = 0;  ///< of the meter's tile, drawn evenly
  std::uint32_t group = 0;  ///< its light group
  Vec3 value{0};            ///< irradiance as this one pixel estimates it
};

/// What one pass leaves.
struct Traced {
  std::vector<Photon> photons;
  // Of light paths, by photon: the partial sums of its weights (vcm::Partial8), and the path's number.
  std::vector<float> d_vcm, d_vc;
  std::vector<std::uint32_t> path;
  std::vector<std::vector<MeterHit>> meters;  ///< one entry a meter of the scene
  Vec3d power{0};                             ///< of all photons together, as they start
  std::uint32_t started = 0;                  ///< photons with any power
};

/// Which light the photons of a method bring.
enum class PhotonKind {
  caustic,     ///< light that meets casters first, and then a receiver; photons are aimed at the casters
  global,      ///< all light that surfaces receive
  light_path,  ///< the same, to be connected and merged with camera paths
};

/// Where photons start, for all passes of a scene: at all lights that next-event estimation samples and, unless they
/// bring caustics alone, at any environment. Emissive surfaces that are not sampled emit none; camera paths find their
/// light.
struct PhotonSource {
  PhotonEmission emission;
  std::vector<std::uint32_t> media_low, media_high;  ///< by light: the media that its light starts in; empty: none
};
/// A light that has a position starts in the media at its middle, others in none.
PhotonSource photon_source(const CompiledScene& scene, PhotonKind kind);

struct PassPlan {
  std::uint32_t photons = 0;
  std::uint32_t seed = 0;  ///< of the pass
  std::uint32_t max_bounces = 0;
  PhotonKind kind = PhotonKind::caustic;
  /// Radius of the disc on which a point meter measures, over its distance from the camera.
  float point_meter_radius_per_distance = 0;
  MergeRadii merging = {};  ///< of light paths
};

/// A photon depends on its number in the pass and on the plan alone. A part of the result if `stop` was requested,
/// which is looked at between bounces.
Traced trace_photons(const CompiledScene& scene, const PhotonSource& source, const PassPlan& plan,
                     RenderCounters& counters, const std::stop_token& stop = {});

}  // namespace lightmill::photons
