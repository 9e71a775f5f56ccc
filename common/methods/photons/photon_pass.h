// One photon pass: its plan, its photon source, and its stored photons.
#pragma once

#include <vector>

#include "common/lights/photon_emission.h"
#include "common/methods/photons/film_splats.h"
#include "common/methods/photons/photon.h"

namespace lightmill::photons {

/// The light that the photons of a method bring, and the defaults of their passes.
struct PhotonKind {
  bool caustic;                     ///< only light that goes via casters to a receiver; else all that surfaces receive
  std::uint32_t pixels_per_photon;  ///< of the film, by default
  double radius;                    ///< gather radius of the first pass, in pixels, by default
  float meter_radius;               ///< of point meters, in gather radii
  bool splats;                      ///< photons that the camera sees directly are drawn into pixels
  bool gathers_near;                ///< but not those in media near the camera (PhotonPass::near)
};

/// Emission of photons, for all passes of a scene. Photons start at all lights that next-event estimation samples.
/// Caustic photons are aimed at casters. Others also start at any environment. Emissive surfaces that are not sampled
/// emit none. Camera paths find their light.
struct PhotonSource {
  PhotonEmission emission;
  std::vector<std::uint32_t> media_low, media_high;  ///< by light: the media in which its light starts; empty: none
};
/// Light of a light with a position starts in the media at its centre. Other light starts in no medium.
PhotonSource photon_source(const CompiledScene& scene, bool caustic);

struct PhotonPassPlan {
  PhotonKind kind;
  std::uint32_t photons = 0;
  std::uint32_t seed = 0;  ///< the pass's
  std::uint32_t max_bounces = 0;
  float radius_per_length = 0;        ///< gather radius over the length of the camera path
  float media_radius_per_length = 0;  ///< the same in media
  float media_free_paths = 0;         ///< limit of the radius in media, in mean free paths

  /// Radius of the disc of a point meter.
  float meter_radius(const CompiledScene& scene, const CompiledMeter& meter) const;
  float meter_area(const CompiledScene& scene, const CompiledMeter& meter) const;
};

/// The column of a meter's tile to which a path belongs (meter_columns.h). Consecutive paths share a column, because their
/// points are stratified.
inline std::uint32_t meter_column(std::uint32_t path, std::uint32_t paths) {
  return static_cast<std::uint32_t>(std::uint64_t{path} * kTileSize / paths);
}

/// A photon that crossed a meter.
struct MeterHit {
  std::uint32_t pixel = 0;  ///< of the meter's tile, in the column of the photon's path
  std::uint32_t group = 0;  ///< its light group
  Vec3 value{0};            ///< irradiance that this pixel estimates
};

/// Photons of one pass. Immutable once it is traced. A method's pass derives from it, and adds what finds its photons:
///
///   void trace(const CompiledScene&, const PhotonSource&, RenderCounters&, const std::stop_token&)
///                                    by PhotonTracer; incomplete if a stop was requested
///   void index(const CompiledScene&) follows, if there are photons
///   std::uint64_t bytes() const
struct PhotonPass {
  PhotonPassPlan plan;
  std::vector<Photon> photons;
  std::vector<Photon> in_media;  ///< photons where media scatter them
  /// Photons in media that are nearer to the camera are gathered, and the others are drawn into pixels. A drawn photon
  /// counts by the inverse square of its distance, which has no limit.
  float near = 0;
  std::vector<std::vector<MeterHit>> meters;  ///< one entry per meter of the scene
  FilmSplats splats, media_splats;
  Vec3d power{0};             ///< sum over the photons, as they start
  std::uint32_t started = 0;  ///< photons with power above 0
  std::size_t stored() const { return photons.size() + in_media.size(); }
  std::uint64_t bytes() const;
};

}  // namespace lightmill::photons
