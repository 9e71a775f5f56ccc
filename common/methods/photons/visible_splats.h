// Visibility of the splats of a tile.
#pragma once

#include <functional>

#include "common/methods/photons/photon_pass.h"
#include "common/methods/transmittance.h"

namespace lightmill::photons {

/// Eight photons, seen from the camera.
struct VisibleSplat8 {
  M8 lanes;   ///< visible photons
  U8 number;  ///< number of the photon
  U8 pixel;   ///< pixel of the tile, row by row
  Photon8 photon;
  Arrival8 arrival;
  Surface8 surface;  ///< on which they lie
  V8 direction;      ///< unit, from the camera to the photon
  F8 cosine;         ///< to the geometric normal, positive
  F8 distance;
  /// Solid angle of the photon's area over that of one pixel, times the filter's weight. The pixel's value is this
  /// factor times the radiance that the surface scatters from the photon's power.
  F8 per_power;
  F8 film_pdf_area;  ///< the same without the filter: density of camera rays, one per pixel
};

/// A ray that connects a point with a photon. It extends beyond the photon, to meet the photon's surface.
struct Connection8 {
  Arrival8 arrival;
  Surface8 surface;
  F8 cosine;   ///< to the geometric normal, positive
  M8 reaches;  ///< lanes that arrive at the photon
};
inline Connection8 connect(const CompiledScene& scene, M8 lanes, const Photon8& photon, const V8& from,
                           const V8& direction, F8 distance, const Media8& media, RenderCounters& counters) {
  const Ray8 rays{from, direction, F8(std::numeric_limits<float>::infinity())};
  const Target8 target{photon.point, photon.geometry, photon.primitive, distance};
  Passing8 passing;
  passing.target = &target;
  Connection8 out;
  out.arrival = trace_transmittance(scene, lanes, rays, media, passing, kNoGeometry, counters);
  std::optional<F8> part;
  if (scene.features().mixtures) {
    part = hashed_number(float_bits(from.x) + photon.primitive, float_bits(photon.wi.x) ^ float_bits(photon.point.y));
  }
  out.surface = scene.surface(out.arrival.rays, out.arrival.hits, part);
  out.cosine = abs(dot(direction, out.surface.geometric_normal));
  out.reaches = lanes & lightmill::reaches(target, out.arrival.hits, out.surface, out.cosine);
  return out;
}

/// Traces a ray from the lens to each splat of the tile. Calls `take` for visible ones, in splat order. `splats` is
/// scratch memory.
///
/// A pixel's value is the integral over the film of filter times radiance. A film area, in pixels, has cos³θ/D² of
/// solid angle. D is the film's distance in pixels. A photon's area has |cos|/d² of solid angle (Pharr, Jakob and
/// Humphreys 2016, "Physically Based Rendering", 16.1.1).
void for_each_visible_splat(const CompiledScene& scene, const PhotonPass& pass, const PixelRect& tile,
                            std::vector<const Splat*>& splats, RenderCounters& counters,
                            const std::function<void(const VisibleSplat8&)>& take);

/// Eight photons in media, seen from the camera.
struct VisibleScatter8 {
  M8 lanes;  ///< visible photons
  U8 pixel;  ///< pixel of the tile, row by row
  Photon8 photon;
  V8 power;  ///< scattered power, attenuated on the way to the camera
  V8 value;  ///< contribution to the pixel
};

/// The same for photons in media. They have no area, so no cosine appears.
void for_each_visible_scatter(const CompiledScene& scene, const PhotonPass& pass, const PixelRect& tile,
                              std::vector<const Splat*>& splats, RenderCounters& counters,
                              const std::function<void(const VisibleScatter8&)>& take);

}  // namespace lightmill::photons
