// Ways through media: absorption along them, and boundaries that light does not notice.
#include "common/methods/path/batch.h"

namespace lightmill::path {

/// Follows the paths through boundaries within another medium to the first that is real, or to another surface, and
/// takes off what is absorbed on the way; `hits` is where they arrive. Returns what crossing there would mean.
Crossing8 Batch::pass_media(Path8& paths, M8 lanes, Hit8& hits) {
  const MediumTable& table = scene_.media();
  const auto absorb = [&](M8 which) {
    const F8 length = select(hits.hit, hits.distance, F8(std::numeric_limits<float>::infinity()));
    const V8 left = table.transmittance(table.current(paths.media), length);
    paths.throughput = select(which, paths.throughput * left, paths.throughput);
  };
  absorb(lanes);
  Crossing8 crossing;
  M8 active = lanes & hits.hit;
  constexpr int kMaxPassed = 1000;  // unreal boundaries in a row: more are overlapping copies without end
  for (int passed = 0; active.any(); ++passed) {
    const Surface8 surface = scene_.surface({paths.origin, paths.direction, F8(0.0f)}, hits);
    const U8 medium = table.of_material(surface.material, active);
    const Crossing8 here = table.cross(paths.media, medium, surface.front);
    crossing = {select(active, here.eta, crossing.eta), select(active, here.beyond, crossing.beyond), M8()};
    active = and_not(active, here.real | (medium == U8(0u)));
    if (active.none()) {
      break;
    }
    if (passed == kMaxPassed) {
      hits.hit = and_not(hits.hit, active);
      paths.throughput = masked(~active, paths.throughput);
      break;
    }
    // Light goes straight on, and next-event estimation cannot have looked through the boundary.
    const V8 onward = select(surface.front, -surface.geometric_normal, surface.geometric_normal);
    paths.origin = select(active, surface.point + onward * surface.offset, paths.origin);
    paths.media = select(active, here.beyond, paths.media);
    paths.pdf_solid_angle = select(active, F8(0.0f), paths.pdf_solid_angle);
    const Ray8 rays{paths.origin, paths.direction, F8(std::numeric_limits<float>::infinity())};
    add_untraceable(active, rays, paths.slot);
    const Hit8 next = scene_.accel().intersect(active, rays, false);
    hits = select(active, next, hits);
    ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(active.count());
    absorb(active);
    active = active & hits.hit;
  }
  return crossing;
}

}  // namespace lightmill::path
