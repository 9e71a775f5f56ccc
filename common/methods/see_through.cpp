#include "common/methods/see_through.h"

namespace lightmill {
namespace {

/// A distance along unit rays beyond a hit. A ray cannot meet the same surface again behind it, nor one in the same
/// place.
F8 behind(const Ray8& rays, const Hit8& hits, const Surface8& surface) {
  const F8 cosine = abs(dot(rays.direction, surface.geometric_normal));
  const F8 off = surface.offset / max(cosine, F8(1e-3f));
  return hits.distance + max(off, hits.distance * F8(0x1p-20f));
}

}  // namespace

Hit8 pass_surfaces(const CompiledScene& scene, M8 lanes, const Ray8& rays, Hit8 hits, Passing8& passing,
                   RenderCounters& counters) {
  M8 active = lanes;
  for (std::uint32_t passed = 0; passed < kMaxPassed; ++passed) {
    Hit8 here = hits;
    here.hit = scene.may_pass(hits, active & hits.hit);
    here.hit = and_not(here.hit, hits.geometry == U8(passing.opaque_geometry));
    if (here.hit.none()) {
      break;
    }
    const Surface8 surface = scene.surface(rays, here);
    const F8 left = passing.left * (F8(1.0f) - scene.materials().opacity(surface, here.hit));
    active = here.hit & (left > passing.number);
    if (passing.target != nullptr) {
      const F8 cosine = abs(dot(rays.direction, surface.geometric_normal));
      active = and_not(active, reaches(*passing.target, here, surface, cosine));
    }
    if (active.none()) {
      break;
    }
    passing.left = select(active, left, passing.left);
    hits = select(active, scene.accel().intersect(active, rays, false, behind(rays, here, surface)), hits);
    counters.closest_hit_rays += static_cast<std::uint64_t>(active.count());
  }
  return hits;
}

F8 share_passed(const CompiledScene& scene, M8 blocked, const Ray8& rays, RenderCounters& counters) {
  if (!scene.features().opacity || blocked.none()) {
    return F8(0.0f);
  }
  const F8 length = sqrt(length_squared(rays.direction));
  const Ray8 unit{rays.origin, rays.direction * (F8(1.0f) / length), rays.max_distance * length};
  Passing8 passing;
  const Hit8 hits = nearest_stop(scene, blocked, unit, false, passing, counters);
  return masked(and_not(blocked, hits.hit), passing.left);
}

}  // namespace lightmill
