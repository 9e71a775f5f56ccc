#include "common/methods/transmittance.h"

namespace lightmill {

Arrival8 trace_transmittance(const CompiledScene& scene, M8 lanes, const Ray8& rays, const Media8& media,
                             Passing8 passing, std::uint32_t through, RenderCounters& counters,
                             const TakeSegments& take) {
  passing.opaque_geometry = through;
  const bool has_media = scene.features().media;
  const MediumTable& table = scene.media();
  Arrival8 out{{}, rays, media, {F8(1.0f), media, M8()}, broadcast(Vec3(1)), {}};
  F8 skipped(0.0f);  // part of the way that the offset from the last surface skipped
  M8 active = lanes;
  for (std::uint32_t passed = 0; active.any(); ++passed) {
    if (const M8 overfull = active & MediumTable::overfull(out.media); has_media && overfull.any()) [[unlikely]] {
      const V8 nothing_known = broadcast(Vec3(std::numeric_limits<float>::quiet_NaN()));
      out.transmittance = select(overfull, nothing_known, out.transmittance);
      active = and_not(active, overfull);
    }
    const Hit8 hits = nearest_stop(scene, active, out.rays, false, passing, counters);
    counters.closest_hit_rays += static_cast<std::uint64_t>(active.count());
    if (has_media) {
      const F8 length = select(hits.hit, hits.distance, out.rays.max_distance) + skipped;
      const V8 left = table.transmittance(table.current(out.media), length);
      out.transmittance = select(active, out.transmittance * left, out.transmittance);
      if (take) {
        take(active, {out.rays.origin - rays.direction * skipped, length, out.media, passed});
      }
    }
    active = active & hits.hit;
    out.hits = select(active, hits, out.hits);
    if ((!has_media && through == kNoGeometry) || active.none()) {
      break;
    }
    const Surface8 surface = scene.surface(out.rays, hits);
    M8 open = active & (hits.geometry == U8(through));
    if (has_media) {
      const U8 medium = table.of_material(surface.material, active);
      const Crossing8 here = table.cross(out.media, medium, surface.front);
      const M8 boundary = and_not(active, medium == U8(0u));
      out.crossing = {select(active, here.eta, out.crossing.eta), select(active, here.beyond, out.crossing.beyond),
                      M8()};
      const M8 unnoticed = and_not(boundary, here.real);
      if (scene.features().emissive_surfaces && unnoticed.any()) {
        const M8 emitting = scene.materials().emits(surface, unnoticed);
        const F8 cosine = abs(dot(rays.direction, surface.geometric_normal));
        const V8 light = out.transmittance * scene.materials().emission(surface, cosine, emitting);
        out.emission = select(emitting, out.emission + light, out.emission);
      }
      open = open | unnoticed;
      out.media = select(open & boundary, here.beyond, out.media);
    }
    active = passed < kMaxPassed ? open : M8();
    const V8 onward = select(surface.front, -surface.geometric_normal, surface.geometric_normal) * surface.offset;
    const V8 origin = surface.point + onward;
    const F8 rest = out.rays.max_distance - dot(origin - out.rays.origin, rays.direction);
    out.rays.origin = select(active, origin, out.rays.origin);
    out.rays.max_distance = select(active, rest, out.rays.max_distance);
    out.hits.hit = and_not(out.hits.hit, active);
    skipped = select(active, dot(onward, rays.direction), skipped);
  }
  if (scene.features().opacity && !passing.decides) {
    out.transmittance = out.transmittance * passing.left;
  }
  return out;
}

}  // namespace lightmill
