// Ways through media: absorption along them, and boundaries that light does not notice.
#include "common/methods/path/batch.h"

namespace lightmill::path {
namespace {

constexpr int kMaxPassed = 1000;  ///< boundaries in a row that light does not notice: more are copies without end

V8 onward(const Surface8& surface) {
  return select(surface.front, -surface.geometric_normal, surface.geometric_normal) * surface.offset;
}

}  // namespace

/// Follows the paths through boundaries that light does not notice to the first that it does, or to another surface,
/// and takes off what is absorbed on the way; `hits` is where they arrive, as seen from where they start. Returns what
/// crossing there would mean.
Crossing8 Batch::pass_media(Path8& paths, M8 lanes, Hit8& hits) {
  const MediumTable& table = scene_.media();
  V8 origin = paths.origin;
  F8 passed_length(0.0f);
  F8 skipped(0.0f);  // of the way, by moving off the surface before
  const auto absorb = [&](M8 which) {
    const F8 length = select(hits.hit, hits.distance + skipped, F8(std::numeric_limits<float>::infinity()));
    const V8 left = table.transmittance(table.current(paths.media), length);
    paths.throughput = select(which, paths.throughput * left, paths.throughput);
  };
  absorb(lanes);
  Crossing8 crossing;
  M8 active = lanes & hits.hit;
  for (int passed = 0; active.any(); ++passed) {
    const Surface8 surface = scene_.surface({origin, paths.direction, F8(0.0f)}, hits);
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
    const V8 off = onward(surface);
    origin = select(active, surface.point + off, origin);
    skipped = dot(off, paths.direction);
    paths.media = select(active, here.beyond, paths.media);
    const Ray8 rays{origin, paths.direction, F8(std::numeric_limits<float>::infinity())};
    add_untraceable(active, rays, paths.slot);
    hits = select(active, scene_.accel().intersect(active, rays, false), hits);
    ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(active.count());
    absorb(active);
    passed_length = select(active, dot(origin - paths.origin, paths.direction), passed_length);
    active = active & hits.hit;
  }
  hits.distance = hits.distance + passed_length;
  return crossing;
}

/// The same for shadow rays, of which those in `lanes` meet something: what of their light arrives.
V8 Batch::light_through_media(const Shadow8& shadows, M8 lanes, M8 blocked) {
  const MediumTable& table = scene_.media();
  const F8 length = sqrt(length_squared(shadows.direction));
  const V8 direction = shadows.direction * (F8(1.0f) / length);
  Media8 media = shadows.media;
  V8 origin = shadows.origin;
  V8 left = table.transmittance(table.current(media), length);
  V8 passed = broadcast(Vec3(1));
  M8 active = lanes & blocked;
  M8 lost;
  F8 skipped(0.0f);
  for (int i = 0; active.any(); ++i) {
    const F8 rest = length - dot(origin - shadows.origin, direction);
    const Ray8 rays{origin, direction, rest};
    const Hit8 hits = scene_.accel().intersect(active, rays, false);
    ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(active.count());
    const V8 along = table.transmittance(table.current(media), select(hits.hit, hits.distance, rest) + skipped);
    passed = select(active, passed * along, passed);
    active = active & hits.hit;
    if (active.none()) {
      break;
    }
    const Surface8 surface = scene_.surface(rays, hits);
    const U8 medium = table.of_material(surface.material, active);
    const Crossing8 here = table.cross(media, medium, surface.front);
    const M8 stopped = active & (here.real | (medium == U8(0u)) | M8(i == kMaxPassed));
    lost = lost | stopped;
    active = and_not(active, stopped);
    const V8 off = onward(surface);
    origin = select(active, surface.point + off, origin);
    skipped = dot(off, direction);
    media = select(active, here.beyond, media);
  }
  return masked(~lost, select(blocked, passed, left));
}

}  // namespace lightmill::path
