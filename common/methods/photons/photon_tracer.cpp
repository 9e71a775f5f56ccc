#include "common/methods/photons/photon_tracer.h"

#include "common/methods/path/sample_plan.h"
#include "common/methods/photons/photon_queue.h"
#include "common/methods/surface_bsdf.h"
#include "common/methods/travel.h"
#include "common/methods/vcm/light_densities.h"
#include "common/methods/vcm/pdf_back.h"
#include "common/scene/compiled/eye_media.h"

namespace lightmill::photons {
namespace {

using path::bsdf_decision;
using path::choice_decision;
using path::decide;
using path::light_decision;

constexpr std::uint32_t kBatchPhotons = 1024;  ///< in flight

class Tracer {
 public:
  Tracer(const CompiledScene& scene, const PhotonSource& source, const PassPlan& plan, RenderCounters& counters)
      : scene_(scene), source_(source), plan_(plan), counters_(counters), now_(kBatchPhotons), next_(kBatchPhotons) {
    out_.meters.resize(scene.meters().size());
  }

  Traced run(const std::stop_token& stop) {
    for (std::uint32_t first = 0; first < plan_.photons && !stop.stop_requested(); first += kBatchPhotons) {
      start(first, std::min(first + kBatchPhotons, plan_.photons));
      // Decisions of the start are those of vertex 0.
      for (std::uint32_t vertex = 1; now_.size() > 0 && !stop.stop_requested(); ++vertex) {
        next_.clear();
        for (int i = 0; i < now_.size(); i += 8) {
          step(now_.load(i), first_lanes(now_.size() - i), vertex);
        }
        std::swap(now_, next_);
      }
    }
    return std::move(out_);
  }

 private:
  void start(std::uint32_t first, std::uint32_t last) {
    now_.clear();
    const U8 seed(plan_.seed);
    for (std::uint32_t i = first; i < last; i += 8) {
      const U8 index = U8(i) + U8::lane_index();
      const PhotonEmission::Photon8 p =
          source_.emission.emit(decide(index, seed, 0, choice_decision(0)), decide(index, seed, 0, light_decision(0)),
                                decide(index, seed, 0, bsdf_decision(0)));
      const F8 largest = max_component(p.power);
      M8 lanes = first_lanes(static_cast<int>(last - i)) & p.valid & (largest > F8(0.0f));
      const VectorLanes powers(p.power);
      for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
        out_.power += Vec3d(powers[std::countr_zero(bits)]) * (1.0 / plan_.photons);
        ++out_.started;
      }
      Media8 media;
      if (!source_.media_low.empty()) {
        media = {gather(source_.media_low.data(), p.light, lanes), gather(source_.media_high.data(), p.light, lanes)};
      }
      const M8 sampled = lanes & signed_less(p.light, U8(static_cast<std::uint32_t>(scene_.lights().size())));
      const U8 group = select(sampled, scene_.lights().group(p.light, sampled), U8(scene_.environment_group()));
      const U8 tag = group << kTagGroupShift;
      vcm::Partial8 partial{F8(0.0f), F8(0.0f)};
      if (connects()) {
        partial.vcm = source_.emission.pdf(p.light, p.origin, p.direction, p.cosine, lanes);
        lanes = lanes & (partial.vcm > F8(0.0f));  // what rounding has put off the disc of a distant light
      }
      now_.push(lanes, {p.origin, p.direction, p.power * F8(1.0f / static_cast<float>(plan_.photons)),
                        F8(static_cast<float>(plan_.photons)) / largest, index, tag, U8(0u), media, partial, p.light,
                        p.cosine});
    }
  }

  void step(Photon8 photon, M8 lanes, std::uint32_t vertex) {
    const Ray8 rays{photon.origin, photon.direction, F8(std::numeric_limits<float>::infinity())};
    const Arrival8 arrival = travel(scene_, lanes, rays, photon.media, kNoGeometry, counters_);
    const Surface8 surface = scene_.surface(arrival.rays, arrival.hits);
    if (!out_.meters.empty()) {
      const F8 way = select(arrival.hits.hit, dot(surface.point - photon.origin, photon.direction), rays.max_distance);
      cross_meters(photon, and_not(lanes, others_light(photon)), way, vertex);
    }
    if (vertex > plan_.max_bounces) {
      return;
    }
    const M8 casters = scene_.materials().casters(surface.material, arrival.hits.hit);
    const M8 stays = and_not(and_not(arrival.hits.hit, casters), others_light(photon));
    if ((casters | stays).none()) {
      return;
    }
    photon.power = photon.power * arrival.transmittance;
    photon.tag = photon.tag + U8(1u);
    photon.media = arrival.media;
    const Place place{photon,
                      arrival,
                      surface,
                      select(surface.front, surface.geometric_normal, -surface.geometric_normal),
                      Frame8(select(surface.front, surface.shading_normal, -surface.shading_normal)),
                      vertex,
                      connects() ? arrived(photon, surface.point, surface.geometric_normal, arrival.hits.hit, vertex)
                                 : photon.partial,
                      connects() ? plan_.merging.factor(surface.point, plan_.photons) : F8(0.0f)};
    const V8 wo = place.frame.to_local(-photon.direction);
    for_each_kind(scene_.materials(), surface, casters | stays, [&](MaterialKind kind, M8 of_kind) {
      visit_bsdf(scene_, kind, surface, arrival.crossing, wo, of_kind, [&](const auto& bsdf, M8 there) {
        if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(bsdf)>, HoldoutSurface>) {
          scatter(place, bsdf, wo, casters, there);
        }
      });
    });
  }

  /// Of caustics alone, those that have met nothing yet are what others find.
  M8 others_light(const Photon8& photon) const {
    return plan_.followed == Followed::caustics ? photon.met == U8(0u) : M8();
  }

  struct Place {
    const Photon8& photon;
    const Arrival8& arrival;
    const Surface8& surface;
    V8 facing;     ///< the geometric normal on the ray's side
    Frame8 frame;  ///< around the shading normal on the ray's side
    std::uint32_t vertex;
    vcm::Partial8 partial;  ///< as it arrives
    F8 merging;
  };

  bool connects() const { return plan_.followed == Followed::paths; }

  /// The partial sums of photons that arrive at a point.
  vcm::Partial8 arrived(const Photon8& photon, const V8& point, const V8& normal, M8 lanes,
                        std::uint32_t vertex) const {
    const F8 cosine = max(abs(dot(photon.direction, normal)), F8(1e-8f));
    if (vertex > 1) {
      return vcm::arrive(photon.partial, length_squared(point - photon.origin), cosine);
    }
    vcm::LightDensities8 light = vcm::light_densities(scene_, source_.emission, photon.light, point, photon.origin,
                                                      photon.direction, photon.cosine, lanes);
    light.emission = photon.partial.vcm;
    return vcm::first_arrival(light, cosine);
  }

  template <class Bsdf>
  void scatter(const Place& place, const Bsdf& bsdf, const V8& wo, M8 casters, M8 lanes) {
    const U8 seed(plan_.seed);
    const Photon8& in = place.photon;
    BsdfSample8 s;
    if constexpr (requires { bsdf.eval(wo, wo); }) {
      if (const M8 stays = connects() ? lanes : and_not(lanes, casters); stays.any()) {
        deposit(place, stays);
      }
      F8 choice(0.0f);
      if constexpr (Bsdf::kHasLobes) {
        choice = decide(in.index, seed, place.vertex, choice_decision(place.vertex)).v;
      }
      s = bsdf.sample(wo, decide(in.index, seed, place.vertex, bsdf_decision(place.vertex)), choice);
    } else if constexpr (requires { bsdf.sample(wo); }) {
      s = bsdf.sample(wo);
    } else {
      s = bsdf.sample(wo, decide(in.index, seed, place.vertex, bsdf_decision(place.vertex)).u);
    }
    vcm::Partial8 partial{F8(0.0f), F8(0.0f)};
    if (connects()) {
      const F8 cosine = abs(dot(place.frame.to_world(s.wi), place.facing));
      partial = vcm::scatter_delta(place.partial, cosine);
      if constexpr (requires { bsdf.eval(wo, wo); }) {
        const F8 back = vcm::pdf_back(scene_, place.surface, place.arrival.crossing, bsdf, wo, s.wi, lanes);
        partial = vcm::select(s.pdf_solid_angle > F8(0.0f),
                              vcm::scatter(place.partial, place.merging, cosine, s.pdf_solid_angle, back), partial);
      }
    }
    go_on(place, s, wo, casters, partial, lanes);
  }

  /// Light as particles: refraction does not thin it out, as it does radiance (eta²), and shading normals count by the
  /// other direction: Veach 1997, 5.2.2 and 5.3.2.
  void go_on(const Place& place, const BsdfSample8& s, const V8& wo, M8 casters, const vcm::Partial8& partial,
             M8 lanes) {
    const F8 offset = place.surface.offset;
    Photon8 out = place.photon;
    out.partial = partial;
    out.direction = place.frame.to_world(s.wi);
    out.origin = place.surface.point + place.facing * select(s.transmitted, -offset, offset);
    const F8 side = dot(out.direction, place.facing);
    lanes = and_not(lanes, select(s.transmitted, side > F8(0.0f), side < F8(0.0f)));
    const F8 from = abs(dot(place.photon.direction, place.facing)) * abs(s.wi.z);
    const F8 normals = select(from > F8(0.0f), wo.z * abs(side) / from, F8(0.0f));
    out.power = out.power * s.weight * (s.eta * s.eta * normals);
    const F8 survival = max_component(out.power) * out.scale;
    const M8 at_risk = survival < F8(1.0f);
    const F8 u = hashed_number(out.index, path_seed(choice_decision(place.vertex)));
    lanes = and_not(lanes & (survival > F8(0.0f)), at_risk & (u >= survival));
    out.power = out.power * select(at_risk, F8(1.0f) / survival, F8(1.0f));
    if (scene_.features().media) {
      out.media = select(s.transmitted, place.arrival.crossing.beyond, out.media);
    }
    out.met = select(casters, select(out.met == U8(0u), U8(1u), out.met), U8(2u));
    if (lanes.any()) {
      next_.push(lanes, out);
    }
  }

  U8 path_seed(std::uint32_t decision) const { return decision_seed(U8(plan_.seed), decision); }

  void deposit(const Place& place, M8 lanes) {
    const VectorLanes point(place.surface.point), wi(-place.photon.direction), power(place.photon.power),
        normal(place.surface.geometric_normal);
    alignas(32) std::uint32_t geometry[8], primitive[8], tag[8], met[8];
    place.arrival.hits.geometry.store(geometry);
    place.arrival.hits.primitive.store(primitive);
    place.photon.tag.store(tag);
    place.photon.met.store(met);
    alignas(32) float d_vcm[8], d_vc[8];
    alignas(32) std::uint32_t index[8];
    place.partial.vcm.store(d_vcm);
    place.partial.vc.store(d_vc);
    place.photon.index.store(index);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      out_.deposits.push_back(
          {point[i], wi[i], power[i], normal[i], geometry[i], primitive[i], tag[i], met[i] < 2 ? 1u : 0u});
      if (connects()) {
        out_.d_vcm.push_back(d_vcm[i]);
        out_.d_vc.push_back(d_vc[i]);
        out_.path.push_back(index[i]);
      }
    }
  }

  void cross_meters(const Photon8& photon, M8 lanes, F8 way, std::uint32_t vertex) {
    for (std::size_t m = 0; lanes.any() && m < out_.meters.size(); ++m) {
      if (!scene_.meters()[m].looks) {
        cross_meter(scene_.meters()[m], out_.meters[m], photon, lanes, way, vertex);
      }
    }
  }

  void cross_meter(const MeterPlace& meter, std::vector<MeterHit>& hits, const Photon8& photon, M8 lanes, F8 way,
                   std::uint32_t vertex) {
    const V8 normal = broadcast(meter.direction);
    const V8 corner = broadcast(meter.corner) + normal * surface_offset(normal, broadcast(meter.magnitude));
    const F8 cosine = -dot(photon.direction, normal);
    const F8 at = -dot(corner - photon.origin, normal) / cosine;
    const V8 q = photon.origin + photon.direction * at - corner;
    const V8 edge1 = broadcast(meter.edge1), edge2 = broadcast(meter.edge2);
    const V8 across = cross(edge1, edge2);
    F8 area = sqrt(length_squared(across));
    M8 inside;
    if (meter.edge1 == Vec3(0)) {
      const float radius = plan_.point_meter_radius_per_distance * glm::length(meter.corner - scene_.camera().eye);
      area = F8(kPi * radius * radius);
      inside = length_squared(q) < F8(radius * radius);
    } else {
      const F8 a = dot(cross(q, edge2), normal) / area, b = dot(cross(edge1, q), normal) / area;
      inside = (a >= F8(0.0f)) & (a < F8(1.0f)) & (b >= F8(0.0f)) & (b < F8(1.0f));
    }
    lanes = lanes & inside & (cosine > F8(0.0f)) & (at > F8(0.0f)) & (at < way);
    if (lanes.none()) {
      return;
    }
    V8 power = photon.power;
    if (scene_.features().media) {
      power = power * travel(scene_, lanes, {photon.origin, photon.direction, at}, photon.media, kNoGeometry, counters_)
                          .transmittance;
    }
    constexpr std::uint32_t kPixels = kTileSize * kTileSize;
    if (connects()) {
      // The meter's own paths start there by the cosine, one a pixel; merging is what a photon does by crossing it.
      const vcm::Partial8 light = arrived(photon, photon.origin + photon.direction * at, normal, lanes, vertex);
      const F8 merging = area * F8(static_cast<float>(plan_.photons) / kPixels);
      power = power * vcm::merged({F8(0.0f), F8(0.0f)}, light, merging, cosine * F8(kInvPi), F8(0.0f));
    }
    const VectorLanes value(power * (F8(static_cast<float>(kPixels)) / area));
    alignas(32) std::uint32_t tag[8], pixel[8];
    photon.tag.store(tag);
    (mix(photon.index * U8(0x9e3779b9u) + U8(plan_.seed ^ 0x6d657465u)) & U8(kPixels - 1)).store(pixel);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      hits.push_back({pixel[i], tag[i] >> kTagGroupShift, value[i]});
    }
  }

  const CompiledScene& scene_;
  const PhotonSource& source_;
  const PassPlan& plan_;
  RenderCounters& counters_;
  PhotonQueue now_, next_;
  Traced out_;
};

/// The media at a place that each light starts from. `off`: how far from its middle along its axis, in sizes of it.
template <class Lights>
void add_media(const CompiledScene& scene, const Lights& lights, double off, PhotonSource& source) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LightBounds b = lights.bounds(i);
    const Vec3d middle = (b.low + b.high) * 0.5;
    const double size = glm::length(b.high - b.low);
    const double rounding = size > 0 ? 1e-5 * glm::length(middle) : 0.0;
    alignas(32) std::uint32_t low[8], high[8];
    const Media8 media = find_media(scene, Vec3(middle + b.axis * (off * size + rounding)), Vec3(b.axis));
    media.low.store(low);
    media.high.store(high);
    source.media_low.push_back(low[0]);
    source.media_high.push_back(high[0]);
  }
}

}  // namespace

PhotonSource photon_source(const CompiledScene& scene, Followed followed) {
  const CausticPlaces& places = scene.caustic_places();
  const LightTable& lights = scene.lights();
  const bool all = followed != Followed::caustics;
  BoundingSphere everything = places.scene;
  if (!places.planes.empty()) {
    everything.radius = std::numeric_limits<double>::infinity();
  }
  const std::span<const BoundingSphere> targets = all ? std::span(&everything, 1) : std::span(places.casters);
  PhotonSource source{PhotonEmission(lights, targets, places.planes, places.scene, all), {}, {}};
  if (scene.features().media && !source.emission.empty()) {
    constexpr double kOnSphere = 0.57736;  // the box around a sphere of radius 1 is 2·√3 long: half of that, inverted
    add_media(scene, lights.facets, 1e-5, source);
    add_media(scene, lights.spheres, kOnSphere / 2, source);
    add_media(scene, lights.points, 0, source);
    add_media(scene, lights.spots, 0, source);
    add_media(scene, lights.cosine_powers, 0, source);
    add_media(scene, lights.ies, 0, source);
    source.media_low.resize(lights.size() + 1, 0);  // an environment that is not sampled comes after the lights
    source.media_high.resize(lights.size() + 1, 0);
  }
  return source;
}

Traced trace_photons(const CompiledScene& scene, const PhotonSource& source, const PassPlan& plan,
                     RenderCounters& counters, const std::stop_token& stop) {
  return Tracer(scene, source, plan, counters).run(stop);
}

}  // namespace lightmill::photons
