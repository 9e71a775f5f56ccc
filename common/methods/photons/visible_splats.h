// Visibility of the splats of a tile.
#pragma once

#include <functional>

#include "common/methods/photons/photon_passes.h"
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
  /// Solid angle of the photon's area over that of one pixel, times the filter's weight. It converts the radiance that
  /// the photon's power becomes into the pixel's value.
  F8 per_power;
  F8 film_pdf_area;  ///< the same without the filter: density of camera rays, one per pixel
};

/// Whether a ray has hit the photon's point. A ray can meet a sphere twice, and both points have the same primitive.
/// The distance tells them apart, beyond rounding.
inline M8 hits_photon(const Arrival8& arrival, const Surface8& surface, const Photon8& d, F8 distance, F8 cosine) {
  const V8 off = surface.point - d.point;
  const F8 tolerance = (surface.offset * F8(256.0f) + distance * F8(0x1p-16f)) / max(cosine, F8(1e-3f));
  return arrival.hits.hit & (arrival.hits.geometry == d.geometry) & (arrival.hits.primitive == d.primitive) &
         (length_squared(off) < tolerance * tolerance);
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

}  // namespace lightmill::photons
