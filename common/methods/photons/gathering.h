// Camera side of photon methods: density estimates along camera paths, directly visible photons, and photons that cross
// meters.
#pragma once

#include "common/methods/factories.h"
#include "common/methods/path/path_estimator.h"
#include "common/methods/photons/gather_pass.h"
#include "common/methods/photons/meter_columns.h"
#include "common/methods/photons/visible_splats.h"
#include "common/methods/tracer/tracer_method.h"

namespace lightmill::photons {

/// Numbers of the photons near each of eight points.
using FoundPhotons = std::array<std::vector<std::uint32_t>, 8>;

template <class Path>
struct PhotonWorkspace : tracer::PathWorkspace<Path> {
  using tracer::PathWorkspace<Path>::PathWorkspace;
  FoundPhotons found;
  std::vector<const Splat*> splats;
  MeterColumns meter_columns;
};

/// Calls `visit(wi, lanes, value)` for each image wi of a photon's direction `from`. `value` is the radiance scattered
/// to wo per unit power: f · |cosine to the shading normal| / |cosine to the geometric one| (Veach 1997, 5.3.2).
template <class Bsdf, class Visit>
void for_each_scattered(const Bsdf& bsdf, const V8& wo, const ShadingFrame8& frame, const V8& from, M8 lanes,
                        const Visit& visit) {
  const F8 per_area = F8(1.0f) / abs(dot(from, frame.facing));
  frame.for_each_wi<Bsdf>(from, lanes, [&](const V8& wi, M8 there) { visit(wi, there, bsdf.eval(wo, wi) * per_area); });
}

/// Finds the photons within `radius` of the points.
template <class Map>
void find_photons(const Map& map, const V8& point, F8 radius, M8 lanes, FoundPhotons& found, RenderCounters& counters) {
  const VectorLanes points(point);
  alignas(32) float radii[8];
  radius.store(radii);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    found[lane].clear();
    if (lanes.bits() >> lane & 1) {
      map.find(points[static_cast<int>(lane)], radii[lane], found[lane]);
    }
    counters.gathered += found[lane].size();
  }
  counters.gathers += static_cast<std::uint64_t>(lanes.count());
}

/// The counts of found photons, and the largest.
inline U8 counts_of(const FoundPhotons& found) {
  alignas(32) std::uint32_t counts[8];
  std::ranges::transform(found, counts, [](const auto& numbers) { return static_cast<std::uint32_t>(numbers.size()); });
  return U8::load(counts);
}
inline std::uint32_t most_of(const FoundPhotons& found) {
  std::size_t most = 0;
  for (const auto& numbers : found) {
    most = std::max(most, numbers.size());
  }
  return static_cast<std::uint32_t>(most);
}
/// Number k of each lane's photons, or 0.
inline U8 numbers_of(const FoundPhotons& found, std::uint32_t k) {
  alignas(32) std::uint32_t numbers[8];
  std::ranges::transform(found, numbers, [&](const auto& each) { return k < each.size() ? each[k] : 0u; });
  return U8::load(numbers);
}

/// Photons on discs around vertices, one per lane and term. Normals, and heights above the disc, exclude photons of
/// other surfaces near by.
class GatherDiscs {
 public:
  GatherDiscs(const tracer::Wavefront& wavefront, const PhotonPass& pass, const FoundPhotons& found, F8 radius,
              const tracer::Vertex8& vertex);

  struct Term8 {
    M8 valid;   ///< the lane has such a photon
    M8 inside;  ///< it lies on the disc with half the radius
    U8 number;  ///< in the pass
    Photon8 photon;
  };
  /// The largest number of terms of a lane.
  std::uint32_t size() const { return size_; }
  Term8 term(std::uint32_t k) const;
  /// 1 / (the disc's area · opacity).
  F8 per_area() const { return F8(kInvPi) / (radius_ * radius_ * opacity_); }

 private:
  const PhotonPass& pass_;
  const FoundPhotons& found_;
  F8 radius_;
  F8 opacity_ = F8(1.0f);  ///< at the vertices
  const Surface8& surface_;
  U8 most_scatterings_;
  U8 counts_;
  std::uint32_t size_;
};

/// Photon density estimate (Jensen 1996, "Global Illumination using Photon Maps", eq. 3): the sum of f · power / (π
/// radius²) over the photons on the disc. `weight(term, wi, value)` may weight a term, and `add(term, value)` takes it.
/// The layer `bias` gets the estimate minus the one with half the radius.
template <class Bsdf, class Weight, class Add>
void estimate_density(tracer::Wavefront& wavefront, const GatherDiscs& discs, const tracer::Vertex8& vertex,
                      const Bsdf& bsdf, const V8& wo, M8 lanes, const Weight& weight, const Add& add) {
  const F8 per_area = discs.per_area();
  V8 beyond_half;
  for (std::uint32_t k = 0; k < discs.size(); ++k) {
    const GatherDiscs::Term8 term = discs.term(k);
    V8 value;
    for_each_scattered(bsdf, wo, vertex, term.photon.wi, term.valid, [&](const V8& wi, M8 there, const V8& scattered) {
      value = value + masked(there, weight(term, wi, term.photon.power * scattered * per_area));
    });
    if (wavefront.channels().bias >= 0) {  // the disc of half the radius has a quarter of the area
      beyond_half = beyond_half + masked(term.valid, select(term.inside, value * F8(-3.0f), value));
    }
    add(term, value);
  }
  if (discs.size() > 0 && wavefront.channels().bias >= 0) {
    wavefront.add_to_layer(wavefront.channels().bias, lanes, vertex.in.slot, vertex.in.throughput * beyond_half);
  }
}

/// Calls `add(splat, bsdf, wo, wi, lanes, value)` for the directly visible photons of a tile. `value` is their
/// contribution to their pixels.
template <class Add>
void add_visible_photons(tracer::Wavefront& wavefront, const PhotonPass& pass, std::vector<const Splat*>& splats,
                         RenderCounters& counters, const Add& add) {
  const CompiledScene& scene = wavefront.scene();
  for_each_visible_splat(scene, pass, wavefront.tile(), splats, counters, [&](const VisibleSplat8& splat) {
    const Surface8& surface = splat.surface;
    const ShadingFrame8 frame(surface);
    const V8 wo = frame.wo(-splat.direction);
    const V8 power = splat.photon.power * splat.arrival.transmittance * splat.per_power;
    for_each_kind(scene.materials(), surface, splat.lanes, [&](MaterialKind kind, M8 of_kind) {
      visit_bsdf(scene, kind, surface, splat.arrival.crossing, wo, of_kind, [&](const auto& bsdf, M8 lanes) {
        if constexpr (requires { bsdf.eval(wo, wo); }) {
          for_each_scattered(bsdf, wo, frame, splat.photon.wi, lanes, [&](const V8& wi, M8 there, const V8& scattered) {
            add(splat, bsdf, wo, wi, there, power * scattered);
          });
        }
      });
    });
  });
}

/// Adds the photons that crossed the tile's meter, and the differences between its columns.
void finish_meter(tracer::Wavefront& wavefront, const PhotonPass& pass, MeterColumns& columns);

/// State of camera paths that gather photons at the first receiver. This is the first surface that is no caster
/// (MaterialTable::casters), or the first point where a medium scatters the path.
struct GatherPayload {
  U8 chain;        ///< kFromCamera, kFromReceiver or kOverCasters
  F8 path_length;  ///< from the camera to the origin
};
struct GatherPath8 : GatherPayload, tracer::Path8 {
  struct AtVertex {
    M8 casters;
  };
};
/// The path has met only casters and delta lobes of receivers since the camera.
inline constexpr std::uint32_t kFromCamera = 0;
/// The last surface was a receiver.
inline constexpr std::uint32_t kFromReceiver = 1;
/// The path has met a receiver, and then only casters. Photons bring the light at its end.
inline constexpr std::uint32_t kOverCasters = 2;

/// Common base of `caustic` and `ppm`: `path`, with photons in place of paths that go from a light via casters.
class GatherEstimator : public path::PathEstimator {
 public:
  using Path = GatherPath8;
  using Workspace = PhotonWorkspace<Path>;
  using Shared = GatherPasses;

  GatherEstimator(const CompiledScene& scene, const GatherPasses& passes, std::uint64_t sample, std::uint64_t end,
                  Workspace& ws)
      : PathEstimator(scene), pass_(passes.pass(sample, end, ws)), ws_(ws) {}

  /// Paths that must not count emitters from which photons start.
  static M8 found_by_photons(const Path& in) { return in.chain == U8(kOverCasters); }

  static void start_on_meter(const CompiledMeter& /*meter*/, Path& path, Path::AtVertex& /*at*/) {
    path.chain = U8(kFromReceiver);
  }
  Path::AtVertex arrive(const Path& /*in*/, const Surface8& surface, M8 lanes) const {
    return {scene_.materials().casters(surface.material, lanes)};
  }

 protected:
  using Vertex = tracer::PathVertex8<Path>;

  static void extend(const Vertex& vertex, const BsdfSample8& sample, Path& out) {
    const M8 from_camera = out.chain == U8(kFromCamera);
    const M8 delta = sample.pdf_solid_angle == F8(0.0f);
    out.chain = select(vertex.at.casters, select(from_camera, U8(kFromCamera), U8(kOverCasters)),
                       select(from_camera & delta, U8(kFromCamera), U8(kFromReceiver)));
    out.path_length = path_length(vertex);
  }

  /// Adds the light of the photons near vertices at the first receiver. Shadow catchers receive none.
  template <class Bsdf>
  void gather(tracer::Wavefront& wavefront, const Vertex& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
    if constexpr (!requires { Bsdf::kEndsPaths; }) {
      lanes = and_not(lanes, vertex.at.casters) & (vertex.path.chain == U8(kFromCamera));
      if (lanes.any()) {
        const F8 radius = pass_->gather_radius(path_length(vertex));
        gather_from(pass_->first, radius, wavefront, vertex, bsdf, wo, lanes);
        gather_from(pass_->later, radius * F8(kLaterRadius), wavefront, vertex, bsdf, wo, lanes);
      }
    }
  }

  /// Adds the light of the photons near points of the first receiver in media: the sum of phase function · power / (4/3
  /// π radius³) (Jensen and Christensen 1998, "Efficient Simulation of Light Transport in Scenes with Participating
  /// Media using Photon Maps", eq. 7).
  void gather_in_media(tracer::Wavefront& wavefront, const Path& in, const tracer::Passage8& passage, M8 lanes,
                       std::uint32_t bounce) {
    lanes = lanes & (in.chain == U8(kFromCamera));
    if (lanes.none() || pass_->scattered.empty()) {
      return;
    }
    const V8 extinction = scene_.media().extinction(passage.medium);
    const F8 radius =
        pass_->media_radius(path_length(in, passage), (extinction.x + extinction.y + extinction.z) * F8(1.0f / 3));
    find_photons(pass_->scattered, passage.point, radius, lanes, ws_.found, ws_.counters);
    const HenyeyGreenstein8 phase{scene_.media().anisotropy(passage.medium)};
    const F8 half = radius * F8(0.5f);
    const F8 per_volume = F8(3 * kInvPi / 4) / (radius * radius * radius * share_inside(in, passage, radius));
    const U8 counts = counts_of(ws_.found), most_scatterings(wavefront.max_bounces() - bounce + 1);
    V8 sum, beyond_half;
    const std::uint32_t size = most_of(ws_.found);
    for (std::uint32_t k = 0; k < size; ++k) {
      const U8 number = numbers_of(ws_.found, k);
      const M8 there = signed_less(U8(k), counts);
      const Photon8 photon = load_photons(pass_->in_media, number, there);
      const M8 valid = there & (photon.primitive == passage.medium) & signed_less(photon.scatterings, most_scatterings);
      const V8 value =
          masked(valid, in.throughput * photon.power * (phase.pdf_solid_angle(-in.direction, photon.wi) * per_volume));
      // The ball of half the radius has an eighth of the volume.
      const M8 inside = length_squared(photon.point - passage.point) < half * half;
      beyond_half = beyond_half + select(inside, value * F8(-7.0f), value);
      if (wavefront.meter() != nullptr) {
        ws_.meter_columns.add(*pass_, pass_->in_media, valid, number, value);
      }
      if (wavefront.channels().separates_lights()) {
        wavefront.add_photons(valid, in.slot, value, photon.group);
      } else {
        sum = sum + value;
      }
    }
    if (size > 0 && !wavefront.channels().separates_lights()) {
      wavefront.add_photons(lanes, in.slot, sum, U8(0u));
    }
    if (size > 0 && wavefront.channels().bias >= 0) {
      wavefront.add_to_layer(wavefront.channels().bias, lanes, in.slot, beyond_half);
    }
  }

  /// The share of a ball around the point that lies in the medium. Paths from the camera enter it by a surface. This is
  /// taken as flat, and its normal as 30° off the path, which refraction turns towards it.
  static F8 share_inside(const Path& in, const tracer::Passage8& passage, F8 radius) {
    constexpr float kCosine = 0.87f;
    const F8 way = sqrt(length_squared(passage.point - passage.origin));
    const F8 u = min(way * F8(kCosine) / radius, F8(1.0f));
    const M8 from_lens = (in.path_length == F8(0.0f)) & (passage.before == F8(0.0f));
    return select(from_lens, F8(1.0f), (F8(2.0f) + F8(3.0f) * u - u * u * u) * F8(0.25f));
  }

  static F8 path_length(const Path& in, const tracer::Passage8& passage) {
    return in.path_length + sqrt(length_squared(passage.point - in.origin));
  }

  std::shared_ptr<const GatherPass> pass_;
  Workspace& ws_;

 private:
  static F8 path_length(const Vertex& vertex) {
    return vertex.path.path_length + sqrt(length_squared(vertex.surface.point - vertex.in.origin));
  }

  template <class Bsdf>
  void gather_from(const PhotonMap& map, F8 radius, tracer::Wavefront& wavefront, const Vertex& vertex,
                   const Bsdf& bsdf, const V8& wo, M8 lanes) {
    if (map.empty()) {
      return;
    }
    find_photons(map, vertex.surface.point, radius, lanes, ws_.found, ws_.counters);
    const Path& in = vertex.path;
    const GatherDiscs discs(wavefront, *pass_, ws_.found, radius, vertex);
    V8 sum;
    estimate_density(
        wavefront, discs, vertex, bsdf, wo, lanes,
        [](const GatherDiscs::Term8& /*term*/, const V8& /*wi*/, const V8& value) { return value; },
        [&](const GatherDiscs::Term8& term, const V8& value) {
          if (wavefront.meter() != nullptr) {
            ws_.meter_columns.add(*pass_, pass_->photons, term.valid, term.number, in.throughput * value);
          }
          if (wavefront.channels().separates_lights()) {
            wavefront.add_photons(term.valid, in.slot, in.throughput * value, term.photon.group);
          } else {
            sum = sum + value;
          }
        });
    if (discs.size() > 0 && !wavefront.channels().separates_lights()) {
      wavefront.add_photons(lanes, in.slot, in.throughput * sum, U8(0u));
    }
  }
};

/// The method of an estimator with photons, or `path` if no light emits photons.
template <class Estimator, class... Args>
std::unique_ptr<Method> make_photon_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                           const MethodSpec& spec, const PhotonKind& kind, const Args&... args) {
  auto shared =
      std::make_unique<const typename Estimator::Shared>(*scene, pass_settings(settings, spec, kind), args...);
  if (shared->empty()) {
    return make_path_method(std::move(scene), settings);
  }
  return std::make_unique<tracer::TracerMethod<Estimator>>(std::move(scene), settings, std::move(shared));
}

}  // namespace lightmill::photons
