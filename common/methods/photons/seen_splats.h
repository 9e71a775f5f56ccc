// Which of a tile's splats are seen, and what finds them there.
#pragma once

#include "common/methods/photons/light_side.h"
#include "common/methods/travel.h"

namespace lightmill::photons {

/// Eight deposits as they are seen from the eye.
struct SeenSplat8 {
  M8 lanes;   ///< those that are seen
  U8 number;  ///< of the deposit
  U8 pixel;   ///< of the tile, row by row
  Deposit8 deposit;
  Arrival8 arrival;
  Surface8 surface;  ///< that they lie on
  V8 direction;      ///< unit, to them
  F8 cosine;         ///< of it to the geometric normal, positive
  F8 distance;
  /// Solid angle of a deposit's area over that of one pixel, times the filter's weight of this one: what its power
  /// becomes in the pixel per radiance that it sends out.
  F8 per_power;
  F8 film_pdf_area;  ///< the same without the filter: of camera rays, one a pixel, finding the place
};

/// Whether the ray has found the deposit itself. On a sphere, which is one primitive, the two points that a ray meets
/// are told apart by more than rounding puts between a deposit and where it is found again.
inline M8 found_again(const Arrival8& arrival, const Surface8& surface, const Deposit8& d, F8 distance, F8 cosine) {
  const V8 off = surface.point - d.point;
  const F8 tolerance = (surface.offset * F8(256.0f) + distance * F8(0x1p-16f)) / max(cosine, F8(1e-3f));
  return arrival.hits.hit & (arrival.hits.geometry == d.geometry) & (arrival.hits.primitive == d.primitive) &
         (length_squared(off) < tolerance * tolerance);
}

/// Follows a ray from the eye to each of the tile's splats, and calls take(const SeenSplat8&) for those that are what
/// it meets, in the order of the splats. `splats` is scratch memory.
///
/// A pixel's value is the integral over the film of the filter times radiance; a place of the film, in pixels, is
/// cos³θ/D² of solid angle, D the film's distance in pixels, and a deposit's solid angle is |cos|/d² of its area
/// (Pharr, Jakob and Humphreys 2016, "Physically Based Rendering", 16.1.1).
template <class Take>
void for_each_seen(const CompiledScene& scene, const LightPass& pass, const PixelRect& tile,
                   std::vector<const Splat*>& splats, RenderCounters& counters, const Take& take) {
  splats.clear();
  pass.splats.find(tile, splats);
  counters.gathered += splats.size();
  const CameraBasis& camera = scene.camera();
  const F8 film_distance2(1.0f / glm::dot(camera.right, camera.right));
  for (std::size_t i = 0; i < splats.size(); i += 8) {
    alignas(32) std::uint32_t number[8] = {}, pixel[8] = {};
    alignas(32) float weight[8] = {}, x[8] = {}, y[8] = {}, z[8] = {};
    const std::size_t count = std::min<std::size_t>(splats.size() - i, 8);
    for (std::size_t k = 0; k < count; ++k) {
      const Splat& splat = *splats[i + k];
      number[k] = splat.deposit;
      pixel[k] = static_cast<std::uint32_t>((splat.y - tile.y) * tile.width + splat.x - tile.x);
      weight[k] = splat.weight;
      x[k] = splat.eye.x;
      y[k] = splat.eye.y;
      z[k] = splat.eye.z;
    }
    const M8 lanes = first_lanes(static_cast<int>(count));
    const V8 eye{F8::load(x), F8::load(y), F8::load(z)};
    SeenSplat8 seen;
    seen.number = U8::load(number);
    seen.pixel = U8::load(pixel);
    seen.deposit = load_deposits(pass.deposits, seen.number, lanes);
    const V8 way = seen.deposit.point - eye;
    seen.distance = sqrt(length_squared(way));
    seen.direction = way * (F8(1.0f) / seen.distance);
    const Ray8 rays{eye, seen.direction, F8(std::numeric_limits<float>::infinity())};
    seen.arrival = travel(scene, lanes, rays, scene.eye_media(), kNoGeometry, counters);
    seen.surface = scene.surface(seen.arrival.rays, seen.arrival.hits);
    seen.cosine = abs(dot(seen.direction, seen.surface.geometric_normal));
    seen.lanes = lanes & found_again(seen.arrival, seen.surface, seen.deposit, seen.distance, seen.cosine);
    if (seen.lanes.none()) {
      continue;
    }
    const F8 cos_film = dot(seen.direction, broadcast(camera.forward));
    const F8 apart = seen.distance * seen.distance * cos_film * cos_film * cos_film;
    seen.per_power = F8::load(weight) * seen.cosine * film_distance2 / apart;
    seen.film_pdf_area = seen.cosine * film_distance2 / apart;
    take(seen);
  }
}

}  // namespace lightmill::photons
