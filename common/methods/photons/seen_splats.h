// Visibility of a tile's splats.
#pragma once

#include <functional>

#include "common/methods/photons/photon_passes.h"
#include "common/methods/transmittance.h"

namespace lightmill::photons {

/// Eight photons as the camera sees them.
struct SeenSplat8 {
  M8 lanes;   ///< those that are visible
  U8 number;  ///< of the photon
  U8 pixel;   ///< of the tile, row by row
  Photon8 photon;
  Arrival8 arrival;
  Surface8 surface;  ///< that they lie on
  V8 direction;      ///< unit, to them
  F8 cosine;         ///< of it to the geometric normal, positive
  F8 distance;
  /// Solid angle of the photon's area over that of one pixel, times the filter's weight: the pixel's value per radiance
  /// that the photon's power becomes.
  F8 per_power;
  F8 film_pdf_area;  ///< the same without the filter: density of one camera ray a pixel
};

/// Whether a ray has hit the photon's point. A sphere is one primitive that a ray meets twice: a distance larger than
/// rounding tells the two points apart.
inline M8 found_again(const Arrival8& arrival, const Surface8& surface, const Photon8& d, F8 distance, F8 cosine) {
  const V8 off = surface.point - d.point;
  const F8 tolerance = (surface.offset * F8(256.0f) + distance * F8(0x1p-16f)) / max(cosine, F8(1e-3f));
  return arrival.hits.hit & (arrival.hits.geometry == d.geometry) & (arrival.hits.primitive == d.primitive) &
         (length_squared(off) < tolerance * tolerance);
}

/// Traces a ray from the lens to each of the tile's splats, and calls `take` for those that it hits, in the order of
/// the splats. `splats` is scratch memory.
///
/// A pixel's value is the integral over the film of the filter times radiance. An area of the film, in pixels, is
/// cos³θ/D² of solid angle, D the film's distance in pixels. A photon's solid angle is |cos|/d² of its area (Pharr,
/// Jakob and Humphreys 2016, "Physically Based Rendering", 16.1.1).
void for_each_seen(const CompiledScene& scene, const PhotonPass& pass, const PixelRect& tile,
                   std::vector<const Splat*>& splats, RenderCounters& counters,
                   const std::function<void(const SeenSplat8&)>& take);

}  // namespace lightmill::photons
