// Photon tracer: traces the photons of one pass from lights to the surfaces and media that store them, eight at a time,
// bounce by bounce. It is compiled once per kind of paths.
#pragma once

#include "common/materials/henyey_greenstein.h"
#include "common/methods/method.h"
#include "common/methods/photons/photon_pass.h"
#include "common/methods/shading_frame.h"
#include "common/methods/surface_bsdf.h"
#include "common/methods/tracer/free_flight.h"
#include "common/methods/tracer/lane_queue.h"
#include "common/methods/tracer/sample_plan.h"
#include "common/methods/transmittance.h"

namespace lightmill::photons {

/// Eight photons in the queue. Paths with more state derive from it, and have their own AtVertex.
struct PhotonPath8 {
  struct AtVertex {};  ///< what the paths need at a surface: nothing

  V8 origin, direction;
  V8 power;
  F8 scale;  ///< 1 / the largest component of the initial power. Russian roulette decides by power times this
  U8 index;  ///< number in the pass
  U8 tag;    ///< Photon::tag, with the scatterings so far
  U8 met;    ///< kNothing, kCasters or kReceivers
  Media8 media;
};

/// What a photon has met since its start: nothing, only casters, or receivers too. Receivers are other surfaces, and
/// media that scattered it.
inline constexpr std::uint32_t kNothing = 0, kCasters = 1, kReceivers = 2;

/// Eight photons at surfaces.
template <class Path>
struct PhotonVertex8 : ShadingFrame8 {
  const Path& photon;
  const Arrival8& arrival;
  const Surface8& surface;
  std::uint32_t number;
  M8 casters;
  [[no_unique_address]] typename Path::AtVertex at;
  F8 weight = F8(1.0f);  ///< of the image of the photon's direction
  M8 stored = {};        ///< lanes whose photon is stored
};

/// Hooks of PhotonTracer, for photons that are gathered.
struct PhotonPaths {
  using Path = PhotonPath8;
  static constexpr bool kStoresAtCasters = false;
  static constexpr bool kScattersInMedia = true;
  bool caustic;  ///< PhotonKind::caustic

  /// Photons start. Returns the lanes that do.
  static M8 start(const PhotonEmission::Photon8& /*emitted*/, Path& /*path*/, M8 lanes) { return lanes; }
  /// The lanes whose light counts at the next surface. For `caustic`, camera paths find light that has met nothing yet.
  M8 counted(const Path& path, M8 lanes) const { return caustic ? and_not(lanes, path.met == U8(kNothing)) : lanes; }
  /// Photons have reached surface `number` of their paths.
  static Path::AtVertex arrive(const Path& /*path*/, const Surface8& /*surface*/, M8 /*lanes*/,
                               std::uint32_t /*number*/) {
    return {};
  }
  /// Photons leave a vertex in direction out.direction, which is the sample's.
  template <class Bsdf>
  static void leave(const PhotonVertex8<Path>& /*vertex*/, const Bsdf& /*bsdf*/, const BsdfSample8& /*sample*/,
                    const V8& /*wo*/, Path& /*out*/, M8 /*lanes*/) {}
  /// The vertex's photons were stored.
  static void store(const PhotonVertex8<Path>& /*vertex*/, M8 /*lanes*/) {}
  /// Weight of photons that cross a meter of this area.
  static F8 meter_weight(const Path& /*path*/, const V8& /*point*/, const V8& /*normal*/, F8 /*area*/, F8 /*cosine*/,
                         M8 /*lanes*/, std::uint32_t /*number*/) {
    return F8(1.0f);
  }
};

/// A photon depends only on its number in the pass and on the plan. `stop` is checked between bounces. If it was
/// requested, the pass is incomplete.
template <class Paths>
class PhotonTracer {
 public:
  using Path = typename Paths::Path;

  PhotonTracer(const CompiledScene& scene, const PhotonSource& source, Paths& paths, PhotonPass& out,
               RenderCounters& counters)
      : scene_(scene), source_(source), plan_(out.plan), paths_(paths), out_(out), counters_(counters) {
    const std::size_t rows = scene.features().normal_maps ? 4 * kSplitBelow : kBatchPhotons;
    now_.reserve(rows);
    next_.reserve(rows);
    out_.meters.resize(scene.meters().size());
  }

  void run(const std::stop_token& stop) {
    for (std::uint32_t first = 0; first < plan_.photons && !stop.stop_requested(); first += kBatchPhotons) {
      emit(first, std::min(first + kBatchPhotons, plan_.photons));
      // Emission takes the decisions of vertex 0.
      for (std::uint32_t vertex = 1; now_.size() > 0 && !stop.stop_requested(); ++vertex) {
        next_.clear();
        for (int i = 0; i < now_.size(); i += 8) {
          trace_segment(now_.load(i), first_lanes(now_.size() - i), vertex);
        }
        std::swap(now_, next_);
      }
    }
  }

 private:
  using Vertex8 = PhotonVertex8<Path>;
  static constexpr std::uint32_t kBatchPhotons = 1024;  ///< photons that start together
  static constexpr int kSplitBelow = 2048;              ///< photons in flight, up to which each may continue as four

  void emit(std::uint32_t first, std::uint32_t last) {
    now_.clear();
    const U8 seed(plan_.seed);
    const F8 photons(static_cast<float>(plan_.photons));
    for (std::uint32_t i = first; i < last; i += 8) {
      const U8 index = U8(i) + U8::lane_index();
      const PhotonEmission::Photon8 p =
          source_.emission.emit(tracer::decide(index, seed, 0, tracer::choice_decision(0)),
                                tracer::decide(index, seed, 0, tracer::light_decision(0)),
                                tracer::decide(index, seed, 0, tracer::bsdf_decision(0)));
      const F8 largest = max_component(p.power);
      M8 lanes = first_lanes(static_cast<int>(last - i)) & p.valid & (largest > F8(0.0f));
      const VectorLanes powers(p.power);
      for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
        out_.power += Vec3d(powers[std::countr_zero(bits)]) * (1.0 / plan_.photons);
        ++out_.started;
      }
      const M8 sampled = lanes & signed_less(p.light, U8(static_cast<std::uint32_t>(scene_.lights().size())));
      const U8 group = select(sampled, scene_.lights().group(p.light, sampled), U8(scene_.environment_group()));
      Path path;
      static_cast<PhotonPath8&>(path) = {
          p.origin,          p.direction, p.power * F8(1.0f / static_cast<float>(plan_.photons)),
          photons / largest, index,       group << kTagGroupShift,
          U8(kNothing),      {}};
      if (!source_.media_low.empty()) {
        path.media = {gather(source_.media_low.data(), p.light, lanes),
                      gather(source_.media_high.data(), p.light, lanes)};
      }
      lanes = paths_.start(p, path, lanes);
      now_.push(lanes, path);
    }
  }

  void trace_segment(Path photon, M8 lanes, std::uint32_t number) {
    const Ray8 rays{photon.origin, photon.direction, F8(std::numeric_limits<float>::infinity())};
    const Passing8 passing =
        scene_.features().opacity
            ? Passing8::decided_by(tracer::decide(photon.index, U8(plan_.seed), number, opacity_decision(number)).u)
            : Passing8{};
    const M8 counted = paths_.counted(photon, lanes);
    Flight8 flight;
    Arrival8 arrival = fly(photon, lanes, counted, rays, passing, number, flight);
    std::optional<F8> part;
    if (scene_.features().mixtures) {
      part = tracer::decide(photon.index, U8(plan_.seed), number, mixture_decision(number)).u;
    }
    const Surface8 surface = scene_.surface(arrival.rays, arrival.hits, part);
    if (!out_.meters.empty()) {
      const F8 length =
          select(arrival.hits.hit, dot(surface.point - photon.origin, photon.direction), rays.max_distance);
      cross_meters(photon, counted, length, passing, number);
    }
    if (number > plan_.max_bounces) {
      return;
    }
    if (flight.scattered.any()) {
      scatter_in_media(photon, flight, number);
      arrival.hits.hit = and_not(arrival.hits.hit, flight.scattered);
    }
    const M8 casters = scene_.materials().casters(surface.material, arrival.hits.hit);
    const M8 scattered = casters | (arrival.hits.hit & counted);
    if (scattered.none()) {
      return;
    }
    photon.power = flight.power;
    photon.tag = photon.tag + U8(1u);
    photon.media = arrival.media;
    Vertex8 vertex{ShadingFrame8(surface),
                   photon,
                   arrival,
                   surface,
                   number,
                   casters,
                   paths_.arrive(photon, surface, arrival.hits.hit, number)};
    if (scene_.features().mixtures) {
      store_at_mixtures(vertex, arrival.hits.hit & counted);
    }
    const V8 wi = vertex.frame.to_local(-photon.direction);
    if ((scattered & vertex.mapped).any()) [[unlikely]] {
      scatter_images(vertex, wi, scattered);
    } else {
      scatter_from(vertex, wi, scattered);
    }
  }

  /// The way of photons to their next vertices.
  struct Flight8 {
    V8 power;      ///< that arrives
    M8 scattered;  ///< lanes that media scatter on the way
    V8 point;      ///< where they do
    V8 collision;  ///< the photon's power there, times the mean free path
    U8 medium;
    Media8 media;
  };

  /// Follows photons to the next surface. Media scatter the lanes of `counted` on the way. Other lanes are only
  /// attenuated, because camera paths find the light that media scatter out of them.
  Arrival8 fly(const Path& photon, M8 lanes, M8 counted, const Ray8& rays, const Passing8& passing,
               std::uint32_t number, Flight8& flight) {
    if constexpr (Paths::kScattersInMedia) {
      if (scene_.features().media && scene_.media().scatters()) {
        flight.power = photon.power;
        const Arrival8 arrival = trace_transmittance(
            scene_, lanes, rays, photon.media, passing, kNoGeometry, counters_,
            [&](M8 active, const MediaSegment8& segment) { pass(photon, active, counted, segment, number, flight); });
        const V8& left = arrival.transmittance;
        flight.power = select(left.x == left.x, flight.power, left);  // unknown media
        return arrival;
      }
    }
    const Arrival8 arrival = trace_transmittance(scene_, lanes, rays, photon.media, passing, kNoGeometry, counters_);
    flight.power = photon.power * arrival.transmittance;
    return arrival;
  }

  /// Lets photons pass a segment, or be scattered on it. They carry flight.power to its start.
  void pass(const Path& photon, M8 lanes, M8 counted, const MediaSegment8& segment, std::uint32_t number,
            Flight8& flight) const {
    const MediumTable& table = scene_.media();
    const U8 medium = table.current(segment.media);
    const V8 extinction = table.extinction(medium), scattering = table.scattering(medium);
    const V8 left = MediumTable::transmittance(extinction, segment.length);
    lanes = and_not(lanes, flight.scattered);
    M8 may = lanes & counted & (max_component(scattering) > F8(0.0f));
    if (number > plan_.max_bounces) {
      may = M8();
    }
    const Pair8 u =
        hashed_pair(photon.index, decision_seed(U8(plan_.seed), tracer::medium_decision(number, segment.passed)));
    const tracer::FreeFlight8 free =
        tracer::sample_free_flight(flight.power, may, extinction, scattering, segment.length, left, u);
    const M8 event = free.event & free.alive;
    flight.scattered = flight.scattered | event;
    flight.point = select(event, segment.origin + photon.direction * free.distance, flight.point);
    flight.collision = select(event, flight.power * free.until * (F8(1.0f) / free.pdf), flight.collision);
    flight.medium = select(event, medium, flight.medium);
    flight.media = select(event, segment.media, flight.media);
    flight.power = select(lanes, flight.power * select(may & free.alive, free.weight, left), flight.power);
  }

  /// Stores photons where media scatter them, and continues their paths.
  void scatter_in_media(const Path& photon, const Flight8& flight, std::uint32_t number) {
    M8 lanes = flight.scattered;
    Path out = photon;
    out.tag = photon.tag + U8(1u);
    store_in_media(out, flight, lanes);
    const HenyeyGreenstein8 phase{scene_.media().anisotropy(flight.medium)};
    out.origin = flight.point;
    out.direction = phase.sample(-photon.direction,
                                 tracer::decide(photon.index, U8(plan_.seed), number, tracer::bsdf_decision(number)));
    out.power = flight.power;
    out.media = flight.media;
    out.met = U8(kReceivers);
    const F8 survival = max_component(out.power) * out.scale;
    lanes = tracer::roulette(lanes & (survival > F8(0.0f)), survival, out.index, U8(plan_.seed), number, out.power);
    if (lanes.any()) {
      next_.push(lanes, out);
    }
  }

  void store_in_media(const Path& photon, const Flight8& flight, M8 lanes) {
    const VectorLanes point(flight.point), wi(-photon.direction), power(flight.collision);
    alignas(32) std::uint32_t medium[8], tag[8], met[8], path[8];
    flight.medium.store(medium);
    photon.tag.store(tag);
    photon.met.store(met);
    photon.index.store(path);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      const bool first = met[i] != kReceivers;
      out_.in_media.push_back({.point = point[i],
                               .wi = wi[i],
                               .power = power[i],
                               .primitive = medium[i],
                               .tag = tag[i],
                               .first = first,
                               .path = path[i]});
    }
  }

  /// Photons are stored at mixtures if any part would store them, whatever part continues their path. Those who use them
  /// draw a part themselves.
  void store_at_mixtures(Vertex8& vertex, M8 lanes) {
    const MaterialTable::Mixed8 mixed = scene_.materials().mixed(vertex.surface.material, lanes);
    const M8 stored = Paths::kStoresAtCasters ? mixed.has_density : mixed.has_receiver;
    if (stored.any()) {
      store(vertex, stored);
    }
    vertex.stored = mixed.lanes;
  }

  /// Calls scatter for each BSDF of the surfaces. Light comes from wi.
  void scatter_from(const Vertex8& vertex, const V8& wi, M8 lanes) {
    for_each_kind(scene_.materials(), vertex.surface, lanes, [&](MaterialKind kind, M8 of_kind) {
      visit_bsdf(scene_, kind, vertex.surface, vertex.arrival.crossing, wi, of_kind, [&](const auto& bsdf, M8 there) {
        if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(bsdf)>, ShadowCatcherSurface>) {
          scatter(vertex, bsdf, wi, there);
        }
      });
    });
  }

  /// Lanes that go the first and the second of two ways, and their weight.
  struct Ways8 {
    M8 first, second;
    F8 weight;
  };
  /// `both`: the lanes that may also go the second way. They go both ways. If there are many paths, one way is drawn.
  /// If it were always drawn, few paths in bumpy glass would survive and carry all the light.
  Ways8 ways(M8 lanes, M8 both, F8 u) const {
    if (now_.size() <= kSplitBelow) {
      return {lanes, both, F8(1.0f)};
    }
    const M8 second = both & (u < F8(0.5f));
    return {and_not(lanes, second), second, select(both, F8(2.0f), F8(1.0f))};
  }
  /// Random numbers for the ways at a mapped normal. Otherwise only the start of a path takes light_decision.
  Pair8 draw_ways(const Vertex8& vertex) const {
    return hashed_pair(vertex.photon.index, decision_seed(U8(plan_.seed), tracer::light_decision(vertex.number)));
  }

  /// Scatters light from both images of a photon's direction (ShadingFrame8::for_each_wi). If the first image is behind
  /// a mapped normal, so is the second.
  void scatter_images(Vertex8& vertex, const V8& wi, M8 lanes) {
    const V8 image = vertex.frame.to_local(mirror_image(-vertex.photon.direction, vertex.facing));
    lanes = and_not(lanes, vertex.mapped & (wi.z <= F8(0.0f)));
    const Ways8 images = ways(lanes, lanes & vertex.mapped & (image.z > F8(0.0f)), draw_ways(vertex).u);
    vertex.weight = images.weight;
    scatter_from(vertex, wi, images.first);
    vertex.stored = vertex.stored | images.first;
    scatter_from(vertex, image, images.second);
  }

  /// At a mapped normal, light leaves in the sampled direction and in its mirror image (ShadingFrame8::wo). Each counts
  /// if it is on the right side of the geometric normal. If the first is on the wrong side, so is the second.
  template <class Bsdf>
  void leave_mapped(const Vertex8& vertex, const Bsdf& bsdf, BsdfSample8 s, const V8& wi, const V8& direction,
                    M8 lanes) {
    const V8 image = mirror_image(direction, vertex.frame.n);
    const F8 side = dot(image, vertex.facing);
    const M8 right = select(s.transmitted, (side < F8(0.0f)), (side > F8(0.0f)));
    const Ways8 sides = ways(lanes, lanes & vertex.mapped & right, draw_ways(vertex).v);
    s.weight = s.weight * (vertex.weight * sides.weight);
    leave(vertex, bsdf, s, wi, direction, sides.first);
    if (sides.second.any()) {
      leave(vertex, bsdf, s, wi, image, sides.second);
    }
  }

  template <class Bsdf>
  void scatter(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    const Path& in = vertex.photon;
    const U8 seed(plan_.seed);
    BsdfSample8 s;
    if constexpr (requires { bsdf.eval(wo, wo); }) {
      const M8 stored = and_not(Paths::kStoresAtCasters ? lanes : and_not(lanes, vertex.casters), vertex.stored);
      if (stored.any()) {
        store(vertex, stored);
      }
      s = tracer::draw_direction(bsdf, wo, in.index, seed, vertex.number);
    } else if constexpr (requires { bsdf.sample(wo); }) {
      s = bsdf.sample(wo);
    } else {
      s = bsdf.sample(wo, tracer::decide(in.index, seed, vertex.number, tracer::bsdf_decision(vertex.number)).u);
    }
    const V8 direction = vertex.frame.to_world(s.wi);
    if (vertex.mapped.any()) [[unlikely]] {
      leave_mapped(vertex, bsdf, s, wo, direction, lanes);
    } else {
      leave(vertex, bsdf, s, wo, direction, lanes);
    }
  }

  /// Continues paths in a direction.
  template <class Bsdf>
  void leave(const Vertex8& vertex, const Bsdf& bsdf, const BsdfSample8& s, const V8& wo, const V8& direction,
             M8 lanes) {
    Path out = vertex.photon;
    out.direction = direction;
    paths_.leave(vertex, bsdf, s, wo, out, lanes);
    continue_path(vertex, s, wo, out, lanes);
  }

  /// Queues a path in its new direction. Light is traced as particles, so refraction does not scale it by eta², unlike
  /// radiance. The correction for shading normals has the directions exchanged (Veach 1997, 5.2.2 and 5.3.2). Russian
  /// roulette follows.
  void continue_path(const Vertex8& vertex, const BsdfSample8& s, const V8& wo, Path& out, M8 lanes) {
    const F8 from = abs(dot(vertex.photon.direction, vertex.facing)) * abs(s.wi.z);
    const F8 offset = vertex.surface.offset;
    out.origin = vertex.surface.point + vertex.facing * select(s.transmitted, -offset, offset);
    const F8 side = dot(out.direction, vertex.facing);
    lanes = and_not(lanes, select(s.transmitted, side > F8(0.0f), side < F8(0.0f)));
    const F8 normals = select(from > F8(0.0f), wo.z * abs(side) / from, F8(0.0f));
    out.power = out.power * s.weight * (s.eta * s.eta * normals);
    // If roulette used the corrected power, it would end paths along a bumpy surface. A later correction would make
    // them bright again.
    out.scale = select(vertex.mapped & (normals > F8(0.0f)), out.scale / normals, out.scale);
    const F8 survival = max_component(out.power) * out.scale;
    lanes =
        tracer::roulette(lanes & (survival > F8(0.0f)), survival, out.index, U8(plan_.seed), vertex.number, out.power);
    if (scene_.features().media) {
      out.media = select(s.transmitted, vertex.arrival.crossing.beyond, out.media);
    }
    out.met = select(vertex.casters, select(out.met == U8(kNothing), U8(kCasters), out.met), U8(kReceivers));
    if (lanes.any()) {
      next_.push(lanes, out);
    }
  }

  void store(const Vertex8& vertex, M8 lanes) {
    const VectorLanes point(vertex.surface.point), wi(-vertex.photon.direction), power(vertex.photon.power),
        normal(vertex.surface.geometric_normal);
    alignas(32) std::uint32_t geometry[8], primitive[8], tag[8], met[8], path[8];
    vertex.arrival.hits.geometry.store(geometry);
    vertex.arrival.hits.primitive.store(primitive);
    vertex.photon.tag.store(tag);
    vertex.photon.met.store(met);
    vertex.photon.index.store(path);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      const bool first = met[i] != kReceivers;
      out_.photons.push_back({point[i], wi[i], power[i], normal[i], geometry[i], primitive[i], tag[i], first, path[i]});
    }
    paths_.store(vertex, lanes);
  }

  void cross_meters(const Path& photon, M8 lanes, F8 length, const Passing8& passing, std::uint32_t number) {
    for (std::size_t m = 0; lanes.any() && m < out_.meters.size(); ++m) {
      if (!scene_.meters()[m].measures_radiance) {
        cross_meter(scene_.meters()[m], out_.meters[m], photon, lanes, length, passing, number);
      }
    }
  }

  void cross_meter(const CompiledMeter& meter, std::vector<MeterHit>& hits, const Path& photon, M8 lanes, F8 length,
                   const Passing8& passing, std::uint32_t number) {
    const V8 normal = broadcast(meter.direction);
    const V8 corner = broadcast(meter.corner) + normal * surface_offset(normal, broadcast(meter.magnitude));
    const F8 cosine = -dot(photon.direction, normal);
    const F8 at = -dot(corner - photon.origin, normal) / cosine;
    const V8 q = photon.origin + photon.direction * at - corner;
    const V8 edge1 = broadcast(meter.edge1), edge2 = broadcast(meter.edge2);
    const F8 area(plan_.meter_area(scene_, meter));
    M8 inside;
    if (meter.edge1 == Vec3(0)) {
      const float radius = plan_.meter_radius(scene_, meter);
      inside = length_squared(q) < F8(radius * radius);
    } else {
      const F8 a = dot(cross(q, edge2), normal) / area, b = dot(cross(edge1, q), normal) / area;
      inside = (a >= F8(0.0f)) & (a < F8(1.0f)) & (b >= F8(0.0f)) & (b < F8(1.0f));
    }
    lanes = lanes & inside & (cosine > F8(0.0f)) & (at > F8(0.0f)) & (at < length);
    if (lanes.none()) {
      return;
    }
    V8 power = photon.power;
    if (scene_.features().media) {
      power = power * trace_transmittance(scene_, lanes, {photon.origin, photon.direction, at}, photon.media, passing,
                                          kNoGeometry, counters_)
                          .transmittance;
    }
    power =
        power * paths_.meter_weight(photon, photon.origin + photon.direction * at, normal, area, cosine, lanes, number);
    const VectorLanes value(power * (F8(static_cast<float>(kTileSize * kTileSize)) / area));
    alignas(32) std::uint32_t tag[8], path[8], row[8];
    photon.tag.store(tag);
    photon.index.store(path);
    (mix(photon.index * U8(0x9e3779b9u) + U8(plan_.seed ^ 0x6d657465u)) & U8(kTileSize - 1)).store(row);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      const std::uint32_t pixel = row[i] * kTileSize + meter_column(path[i], plan_.photons);
      hits.push_back({pixel, tag[i] >> kTagGroupShift, value[i]});
    }
  }

  const CompiledScene& scene_;
  const PhotonSource& source_;
  const PhotonPassPlan& plan_;
  Paths& paths_;
  PhotonPass& out_;
  RenderCounters& counters_;
  LaneQueue<Path> now_, next_;
};

}  // namespace lightmill::photons
