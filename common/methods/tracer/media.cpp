// Segments of paths and shadow rays in media: absorption, sampled distances, and boundaries that do not stop light.
#include "common/methods/tracer/free_flight.h"
#include "common/methods/tracer/inscattering.h"
#include "common/methods/tracer/power_heuristic.h"
#include "common/methods/tracer/scattered_directions.h"
#include "common/methods/tracer/wavefront.h"

namespace lightmill::tracer {
namespace {

/// Next-event estimation has points of its own on a path's first segment, and where a light is within this many mean
/// free paths. Elsewhere a path that scatters uses its own vertex: most light has scattered often there, and the time
/// of other points exceeds their use.
constexpr float kFreePathsToLight = 10;

/// The least extinction of the channels that scatter. Its inverse is the longest mean free path.
F8 least_extinction(const V8& extinction, const V8& scattered) {
  const F8 none(std::numeric_limits<float>::infinity());
  const auto of = [&](F8 sigma, F8 light) { return select(light > F8(0.0f), sigma, none); };
  return min(min(of(extinction.x, scattered.x), of(extinction.y, scattered.y)), of(extinction.z, scattered.z));
}

/// From a surface to a point behind it, beyond rounding errors.
V8 offset_behind(const Surface8& surface) {
  return select(surface.front, -surface.geometric_normal, surface.geometric_normal) * surface.offset;
}

}  // namespace

/// Multiplies the throughput by the transmittance of the segment. In media that scatter it samples a distance, and
/// returns the lanes that scatter before its end, with their distances.
M8 Wavefront::sample_distance(Path8& paths, M8 lanes, const Segment8& segment, F8& scattered_at, F8& density_ratio,
                              Inscattered8& inscattered) const {
  const MediumTable& table = scene_.media();
  const F8 length = segment.length;
  const V8 extinction = table.extinction(segment.medium);
  const V8 left = MediumTable::transmittance(extinction, length);
  const V8 scattering = table.scattering(segment.medium);
  const M8 scatters = lanes & (max_component(scattering) > F8(0.0f));
  if (scatters.none()) {
    paths.throughput = select(lanes, paths.throughput * left, paths.throughput);
    return {};
  }
  const Pair8 u =
      hashed_pair(paths.index, decision_seed(paths.pixel_seed, medium_decision(segment.bounce, segment.passed)));
  const FreeFlight8 flight = sample_free_flight(paths.throughput, scatters, extinction, scattering, length, left, u);
  const F8 distance = flight.distance;
  const M8 event = flight.event;
  if (const M8 lit = scatters & flight.alive & continues(paths); segment.samples_lights) {
    const V8 scattered = paths.throughput * scattering;
    M8 apart = lit;
    if (segment.bounce > 0) {
      const F8 least = least_extinction(extinction, scattered);
      const F8 nearest2 = scene_.lights().equiangular().nearest2(segment.origin);
      apart = lit & (nearest2 * least * least < F8(kFreePathsToLight * kFreePathsToLight));
    }
    density_ratio = select(event, F8(1.0f), density_ratio);
    if (apart.any()) {
      const F8 other_pdf =
          choose_apart(paths, apart, segment, flight.share, extinction, scattered, distance, inscattered);
      density_ratio = select(event & apart, other_pdf / flight.pdf, density_ratio);
    }
    if (const M8 same = and_not(lit & event, apart); same.any()) {
      const V8 throughput = paths.throughput * flight.weight;
      const F8 sum = throughput.x + throughput.y + throughput.z;
      keep(paths, same, segment, {distance, throughput * (F8(1.0f) / sum), F8(1.0f)}, sum, inscattered);
    }
  }
  paths.throughput = select(scatters & flight.alive, paths.throughput * flight.weight, paths.throughput);
  const M8 absorbs = and_not(lanes, scatters);
  paths.throughput = select(absorbs, paths.throughput * left, paths.throughput);
  scattered_at = select(event, distance, scattered_at);
  return event;
}

/// Chooses a point of next-event estimation on the segment, apart from the path's vertex. Returns the density of such
/// points at `distance`, per length.
F8 Wavefront::choose_apart(const Path8& paths, M8 lanes, const Segment8& segment, const V8& share, const V8& extinction,
                           const V8& scattered, F8 distance, Inscattered8& inscattered) const {
  const InscatteringDensity8 density(scene_.lights().equiangular(), segment.origin, paths.direction, segment.length,
                                     scattered, extinction);
  lanes = lanes & density.valid();
  constexpr std::uint32_t kOnlyDecision = 0;  // of this seed
  const U8 seed = decision_seed(paths.pixel_seed, inscattering_decision(segment.bounce, segment.passed));
  const F8 at = density.sample(tracer::decide(paths.index, seed, segment.bounce, kOnlyDecision, plan_.sobol_vertices));
  const V8 until = MediumTable::transmittance(extinction, at);
  const F8 pdf = density.pdf_length(at);
  keep(paths, lanes, segment,
       {at, scattered * until * (F8(1.0f) / (pdf * density.total())), pdf / dot(share, extinction * until)},
       density.total(), inscattered);
  return masked(lanes, density.pdf_length(distance));
}

/// Of the points on a path's segments, one is kept: each by its share of the throughput `total` that the segments
/// scatter. `point.throughput` is divided by the total of its segment.
void Wavefront::keep(const Path8& paths, M8 lanes, const Segment8& segment, const Inscattered8::Point8& point, F8 total,
                     Inscattered8& inscattered) {
  const F8 all = inscattered.total + masked(lanes, total);
  M8 kept = lanes & (total > F8(0.0f));
  const M8 further = kept & (inscattered.total > F8(0.0f));
  if (further.any()) {
    const U8 seed = decision_seed(paths.pixel_seed, inscattering_decision(segment.bounce, segment.passed));
    kept = and_not(kept, and_not(further, hashed_number(paths.index, seed) * all < total));
  }
  inscattered.lanes = inscattered.lanes | kept;
  inscattered.total = all;
  inscattered.point = select(kept, segment.origin + paths.direction * point.distance, inscattered.point);
  inscattered.throughput = select(kept, point.throughput, inscattered.throughput);
  inscattered.density_ratio = select(kept, point.density_ratio, inscattered.density_ratio);
  inscattered.medium = select(kept, segment.medium, inscattered.medium);
  inscattered.media = select(kept, paths.media, inscattered.media);
}

/// Next-event estimation at the chosen points. `density_ratio` scales densities of lights as scatter_in_medium scales
/// those of directions.
void Wavefront::add_inscattered(const Path8& paths, const Inscattered8& inscattered, std::uint32_t bounce) {
  const ScatteredDirections8 directions(scene_.lights().equiangular(), scene_.media(), inscattered.medium,
                                        inscattered.point, -paths.direction);
  Path8 decided = paths;
  decided.pixel_seed = decision_seed(paths.pixel_seed, inscattering_decision(bounce, 0));
  const V8 throughput = inscattered.throughput * inscattered.total;
  for (std::uint32_t draw = 0; draw < scene_.lights().draws(); ++draw) {
    const LightSample8 light = draw_light(inscattered.point, V8(), decided, bounce, draw);
    const F8 weight =
        select(light.pdf_solid_angle > F8(0.0f),
               power_heuristic(light.pdf_solid_angle * inscattered.density_ratio, directions.pdf_solid_angle(light.wi)),
               F8(1.0f));
    push_shadows(inscattered.lanes & light.valid, inscattered.point, light,
                 throughput * light.weight * (directions.phase(light.wi) * weight), paths.slot, inscattered.media);
  }
}

/// Moves the paths through boundaries that do not stop light, to the first surface that does, or to a point where a
/// medium scatters them. `hits` becomes what they reach. A step off a boundary moves a path off its line, by more than
/// the offset at the next surface. So surfaces are computed from the last segment alone.
Passage8 Wavefront::pass_media(Path8& paths, M8 lanes, Hit8& hits, Passing8& passing, std::uint32_t bounce,
                               bool samples_lights, const AddEmission& add_emission) {
  const MediumTable& table = scene_.media();
  Passage8 passage;
  passage.origin = paths.origin;
  F8 skipped(0.0f);  // by the step off the last surface
  Inscattered8 inscattered{M8(), F8(0.0f), V8(), V8(), F8(0.0f), U8(0u), paths.media};
  M8 active = lanes;
  for (std::uint32_t passed = 0; active.any(); ++passed) {
    if (const M8 overfull = active & MediumTable::overfull(paths.media); overfull.any()) [[unlikely]] {
      add_not_finite(overfull, paths.slot);
      paths.throughput = masked(~overfull, paths.throughput);
    }
    const F8 length = select(hits.hit, hits.distance + skipped, F8(std::numeric_limits<float>::infinity()));
    F8 scattered_at(0.0f);
    const Segment8 segment{
        passage.origin - paths.direction * skipped, length, table.current(paths.media), bounce, passed,
        samples_lights && bounce < max_bounces_};
    const M8 scattered = sample_distance(paths, active, segment, scattered_at, passage.density_ratio, inscattered);
    passage.medium = select(scattered, segment.medium, passage.medium);
    passage.scattered = passage.scattered | scattered;
    passage.point = select(scattered, passage.origin + paths.direction * (scattered_at - skipped), passage.point);
    hits.hit = and_not(hits.hit, scattered);
    active = active & hits.hit;
    if (active.none()) {
      break;
    }
    const Surface8 surface = scene_.surface({passage.origin, paths.direction, F8(0.0f)}, hits);
    const U8 medium = table.of_material(surface.material, active);
    const Crossing8 here = table.cross(paths.media, medium, surface.front);
    passage.crossing = {select(active, here.eta, passage.crossing.eta),
                        select(active, here.beyond, passage.crossing.beyond), M8()};
    active = and_not(active, here.real | (medium == U8(0u)));
    if (active.none()) {
      break;
    }
    if (scene_.features().emissive_surfaces) {
      Hit8 passed_hits = hits;
      passed_hits.hit = active;
      passed_hits.distance = hits.distance + passage.before;
      add_emission(passed_hits, surface);
    }
    if (passed == kMaxPassed) {
      hits.hit = and_not(hits.hit, active);
      paths.throughput = masked(~active, paths.throughput);
      break;
    }
    const V8 off = offset_behind(surface);
    passage.origin = select(active, surface.point + off, passage.origin);
    skipped = select(active, dot(off, paths.direction), skipped);
    paths.media = select(active, here.beyond, paths.media);
    const Ray8 rays{passage.origin, paths.direction, F8(std::numeric_limits<float>::infinity())};
    add_untraceable(active, rays, paths.slot);
    hits = select(active, nearest_stop(scene_, active, rays, false, passing, ws_.counters), hits);
    ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(active.count());
    passage.before = select(active, dot(passage.origin - paths.origin, paths.direction), passage.before);
  }
  if (inscattered.lanes.any()) {
    add_inscattered(paths, inscattered, bounce);
  }
  return passage;
}

/// Transmittance of shadow rays. `blocked` rays meet a surface: an opaque one, or a boundary that does not stop light.
V8 Wavefront::shadow_transmittance(const Shadow8& shadows, M8 lanes, M8 blocked) {
  const MediumTable& table = scene_.media();
  const F8 length = sqrt(length_squared(shadows.direction));
  const V8 direction = shadows.direction * (F8(1.0f) / length);
  Media8 media = shadows.media;
  V8 origin = shadows.origin;
  V8 left = table.transmittance(table.current(media), length);
  V8 passed = broadcast(Vec3(1));
  M8 active = lanes & blocked;
  M8 lost, overfull = lanes & MediumTable::overfull(media);
  Passing8 passing;
  F8 skipped(0.0f);
  for (std::uint32_t i = 0; active.any(); ++i) {
    const F8 rest = length - dot(origin - shadows.origin, direction);
    const Ray8 rays{origin, direction, rest};
    const Hit8 hits = nearest_stop(scene_, active, rays, false, passing, ws_.counters);
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
    const V8 off = offset_behind(surface);
    origin = select(active, surface.point + off, origin);
    skipped = dot(off, direction);
    media = select(active, here.beyond, media);
    overfull = overfull | (active & MediumTable::overfull(media));
  }
  const V8 arriving = masked(~lost, select(blocked, passed, left)) * passing.left;
  return select(overfull, broadcast(Vec3(std::numeric_limits<float>::quiet_NaN())), arriving);
}

}  // namespace lightmill::tracer
