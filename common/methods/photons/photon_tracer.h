// Follows light from its sources to where it stays: the deposits of one pass.
#pragma once

#include <vector>

#include "common/lights/photon_emission.h"
#include "common/methods/method.h"
#include "common/methods/photons/deposit.h"
#include "common/methods/photons/merge_radii.h"

namespace lightmill::photons {

/// A photon that has crossed a meter's place on its way.
struct MeterHit {
  std::uint32_t pixel = 0;  ///< of the meter's tile that it falls to
  std::uint32_t group = 0;  ///< its light group
  Vec3 value{0};            ///< irradiance as this one pixel estimates it
};

struct Traced {
  std::vector<Deposit> deposits;
  // Of paths alone, by deposit: the partial sums of their weights, and the path's number.
  std::vector<float> d_vcm, d_vc;
  std::vector<std::uint32_t> path;
  std::vector<std::vector<MeterHit>> meters;  ///< one entry a meter of the scene
  Vec3d power{0};                             ///< of all photons as they start, together
  std::uint32_t started = 0;                  ///< those that carry any
};

/// Which light photons are to bring.
enum class Followed {
  caustics,   ///< what meets casters first, and then another surface: photons are aimed at the casters
  all_light,  ///< that surfaces receive: photons go wherever something may be
  paths,      ///< the same, to be connected and merged with paths from the eye
};

/// What photons start from, for all passes of a scene: all that next-event estimation samples; of all light the
/// environment too, whether it is sampled or not. Surfaces that are not sampled send none. For caustics what is left
/// out so is the camera side's.
struct PhotonSource {
  PhotonEmission emission;
  std::vector<std::uint32_t> media_low, media_high;  ///< by light: the media that its light starts in; empty: none
};
/// Media of lights that have a place are those at its middle; of others there are none.
PhotonSource photon_source(const CompiledScene& scene, Followed followed);

struct PassPlan {
  std::uint32_t photons = 0;
  std::uint32_t seed = 0;  ///< of the pass
  std::uint32_t max_bounces = 0;
  Followed followed = Followed::caustics;
  float point_meter_radius_per_distance =
      0;                    ///< of the disc that a point's irradiance is measured on, by its distance from the eye
  MergeRadii merging = {};  ///< of paths alone
};

/// Photons are told apart by their number alone, so that the result is the same whatever goes before. A part of the
/// result if it was stopped, which it is between scatterings.
Traced trace_photons(const CompiledScene& scene, const PhotonSource& source, const PassPlan& plan,
                     RenderCounters& counters, const std::stop_token& stop = {});

}  // namespace lightmill::photons
