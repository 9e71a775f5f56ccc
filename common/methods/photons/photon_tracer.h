// Photon tracer: traces the photons of one pass from lights to the surfaces that store them.
#pragma once

#include <vector>

#include "common/lights/photon_emission.h"
#include "common/methods/method.h"
#include "common/methods/photons/merge_map.h"
#include "common/methods/photons/photon.h"

namespace lightmill::photons {

/// A photon that crossed a meter.
struct MeterHit {
  std::uint32_t pixel = 0;  ///< of the meter's tile, drawn uniformly
  std::uint32_t group = 0;  ///< its light group
  Vec3 value{0};            ///< irradiance that this pixel estimates
};

/// Result of one pass.
struct PhotonTrace {
  std::vector<Photon> photons;
  // Of light paths only, by photon: vcm::Partial8, and the number of the path.
  std::vector<float> d_vcm, d_vc;
  std::vector<std::uint32_t> path;
  std::vector<std::vector<MeterHit>> meters;  ///< one entry per meter of the scene
  Vec3d power{0};                             ///< sum over the photons, as they start
  std::uint32_t started = 0;                  ///< photons with power above 0
};

/// Light transport that the photons of a method cover.
enum class PhotonKind {
  caustic,     ///< light that goes via casters to a receiver; photons are aimed at casters
  global,      ///< all light that surfaces receive
  light_path,  ///< the same, for connection and merging with camera paths
};

/// Emission of photons, for all passes of a scene. Photons start at all lights that next-event estimation samples.
/// Unless they are caustic photons, they also start at any environment. Emissive surfaces that are not sampled emit
/// none. Camera paths find their light.
struct PhotonSource {
  PhotonEmission emission;
  std::vector<std::uint32_t> media_low, media_high;  ///< by light: the media in which its light starts; empty: none
};
/// Light of a light with a position starts in the media at its centre. Other light starts in no medium.
PhotonSource photon_source(const CompiledScene& scene, PhotonKind kind);

struct PhotonPassPlan {
  std::uint32_t photons = 0;
  std::uint32_t seed = 0;  ///< the pass's
  std::uint32_t max_bounces = 0;
  PhotonKind kind = PhotonKind::caustic;
  /// Radius of a point meter's disc over its distance from the camera.
  float point_meter_radius_per_distance = 0;
  MergeRadii merging = {};  ///< of light paths only
};

/// A photon depends only on its number in the pass and on the plan. `stop` is checked between bounces. If it was
/// requested, the result is incomplete.
PhotonTrace trace_photons(const CompiledScene& scene, const PhotonSource& source, const PhotonPassPlan& plan,
                          RenderCounters& counters, const std::stop_token& stop = {});

}  // namespace lightmill::photons
