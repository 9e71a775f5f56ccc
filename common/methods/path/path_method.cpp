#include "common/methods/path/path_method.h"

#include "common/materials/dielectric.h"
#include "common/materials/diffuse.h"
#include "common/materials/mirror.h"
#include "common/methods/float_environment.h"
#include "common/methods/path/queues.h"
#include "common/methods/primary_rays.h"
#include "common/methods/sample_sums.h"

namespace lightmill {
namespace {

using path::Path8;
using path::PathQueue;
using path::Shadow8;
using path::ShadowQueue;

constexpr std::size_t kBatchPixels =
    1024;  ///< camera rays in flight: large enough for full lanes, small enough for the cache
constexpr std::uint32_t kSobolVertices = 3;  ///< vertices whose decisions are Sobol' pairs
constexpr std::uint32_t kUnsplitSalt = 0x51ed270bu;

/// What depends on the sample index and nothing else: many short-lived paths at first, long ones later.
struct SamplePlan {
  std::uint32_t splits;       ///< paths that go on from the first diffuse surface
  float roulette_boost;       ///< survival = min(1, boost · throughput)
  std::uint32_t index;        ///< point of the half's sequences, for decisions made once a sample
  std::uint32_t split_index;  ///< first of `splits` points, for decisions made once a split path

  explicit SamplePlan(std::uint64_t sample) : index(static_cast<std::uint32_t>(sample >> 1)) {
    constexpr std::uint32_t kSplitBelow = 64, kSplits = 4;
    const bool early = sample < kSplitBelow;
    splits = early ? kSplits : 1;
    roulette_boost = early ? 2.0f : 4.0f;
    split_index = early ? index * kSplits : index + kSplitBelow / 2 * (kSplits - 1);
  }
};

/// Decisions of vertex v: where on a light, which direction, and (which light, live or die).
constexpr std::uint32_t light_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex;
}
constexpr std::uint32_t bsdf_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex + 1;
}
constexpr std::uint32_t choice_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex + 2;
}

Pair8 decide(U8 index, U8 pixel_seed, std::uint32_t vertex, std::uint32_t decision) {
  const U8 seed = decision_seed(pixel_seed, decision);
  return vertex < kSobolVertices ? sobol_pair(index, seed) : hashed_pair(index, seed);
}

/// Power heuristic (β = 2) for two techniques, as the first one's weight; Veach 1997, eq. 9.13.
F8 mis_weight(F8 pdf, F8 other_pdf) {
  const F8 ratio = other_pdf / pdf;
  return F8(1.0f) / (F8(1.0f) + ratio * ratio);
}

class PathWorkspace final : public Workspace {
 public:
  PathQueue paths, next;
  ShadowQueue shadows;
  SampleSums sums;
  std::array<std::vector<std::uint32_t>, 2> pixel_seeds;  ///< one array a half
  std::vector<float> radiance;                            ///< of one sample of the tile: RGB planes of one value a slot
};

/// One batch of one sample: holds what all its steps need.
class Batch {
 public:
  Batch(const CompiledScene& scene, const PixelRect& tile, const SamplePlan& plan, std::uint32_t max_bounces,
        PathWorkspace& ws)
      : scene_(scene),
        tile_(tile),
        plan_(plan),
        max_bounces_(max_bounces),
        ws_(ws),
        pixels_(static_cast<std::uint32_t>(tile.pixel_count())),
        slots_(pixels_ * plan.splits) {}

  void run(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds) {
    start(first_pixel, last_pixel, seeds);
    for (std::uint32_t bounce = 0; ws_.paths.size() > 0; ++bounce) {
      ws_.next.clear();
      ws_.shadows.clear();
      for (int i = 0; i < ws_.paths.size(); i += 8) {
        shade(ws_.paths.load(i), first_lanes(ws_.paths.size() - i), bounce);
      }
      ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(ws_.paths.size());
      trace_shadows();
      std::swap(ws_.paths, ws_.next);
    }
  }

 private:
  void start(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds) {
    ws_.paths.clear();
    for (std::size_t pixel = first_pixel; pixel < last_pixel; pixel += 8) {
      const M8 lanes = first_lanes(static_cast<int>(last_pixel - pixel));
      const U8 pixels = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
      const U8 seed = U8::load(&seeds[pixel]);
      const Ray8 rays = primary_rays(scene_, tile_, pixels, seed, plan_.index);
      ws_.paths.push(
          lanes, {rays.origin, rays.direction, broadcast(Vec3(1)), F8(0.0f), F8(1.0f), pixels, seed, U8(plan_.index)});
    }
  }

  void add_radiance(M8 lanes, U8 slot, const V8& value) {
    alignas(32) float r[8], g[8], b[8];
    alignas(32) std::uint32_t p[8];
    value.x.store(r);
    value.y.store(g);
    value.z.store(b);
    slot.store(p);
    float* const red = ws_.radiance.data();
    float* const green = red + slots_;
    float* const blue = green + slots_;
    for (unsigned bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      red[p[lane]] += r[lane];
      green[p[lane]] += g[lane];
      blue[p[lane]] += b[lane];
    }
  }

  /// A path that arithmetic has led out of all numbers (only degenerate geometry does) makes its sample one that is not
  /// finite: it is counted, not lost in silence.
  void add_untraceable(M8 lanes, const Ray8& rays, U8 slot) {
    const M8 lost = and_not(lanes, Accel::traceable(rays));
    if (lost.any()) [[unlikely]] {
      add_radiance(lost, slot, broadcast(Vec3(std::numeric_limits<float>::quiet_NaN())));
    }
  }

  void shade(const Path8& in, M8 lanes, std::uint32_t bounce) {
    const Ray8 rays{in.origin, in.direction, F8(std::numeric_limits<float>::infinity())};
    add_untraceable(lanes, rays, in.slot);
    const Hit8 hits = scene_.accel().intersect(lanes, rays, bounce == 0);
    if (hits.hit.none()) {
      return;
    }
    const Surface8 surface = scene_.surface(rays, hits);
    if (scene_.features().emissive_surfaces) {
      add_emission(in, hits, surface);
    }
    if (bounce == max_bounces_) {
      return;
    }
    // The frame to shade in is on the ray's side of the surface.
    const V8 facing_geometric = select(surface.front, surface.geometric_normal, -surface.geometric_normal);
    const Frame8 frame(select(surface.front, surface.shading_normal, -surface.shading_normal));

    M8 diffuse_lanes = hits.hit;
    if (scene_.features().specular) {
      const M8 mirror_lanes = scene_.is_kind(surface.material, MaterialKind::mirror, hits.hit);
      const M8 dielectric_lanes = scene_.is_kind(surface.material, MaterialKind::dielectric, hits.hit);
      diffuse_lanes = and_not(and_not(hits.hit, mirror_lanes), dielectric_lanes);
      if (diffuse_lanes.any()) {
        shade_diffuse(in, surface, facing_geometric, frame, diffuse_lanes, bounce);
      }
      if (mirror_lanes.any()) {
        shade_mirror(in, surface, facing_geometric, frame, mirror_lanes, bounce);
      }
      if (dielectric_lanes.any()) {
        shade_dielectric(in, surface, facing_geometric, frame, dielectric_lanes, bounce);
      }
    } else {
      shade_diffuse(in, surface, facing_geometric, frame, diffuse_lanes, bounce);
    }
  }

  /// Light that the path finds by itself, weighted against next-event estimation having found it.
  void add_emission(const Path8& in, const Hit8& hits, const Surface8& surface) {
    const M8 emitting = scene_.emits(surface, hits.hit);
    if (emitting.none()) {
      return;
    }
    const F8 cos_light = abs(dot(in.direction, surface.geometric_normal));
    const F8 light_pdf = scene_.light_pdf_solid_angle(in.origin, hits, cos_light, emitting);
    const F8 weight = select(in.pdf_solid_angle > F8(0.0f), mis_weight(in.pdf_solid_angle, light_pdf), F8(1.0f));
    add_radiance(emitting, in.slot, in.throughput * scene_.emission(surface.material, emitting) * weight);
  }

  void shade_diffuse(const Path8& in, const Surface8& surface, const V8& facing, const Frame8& frame, M8 lanes,
                     std::uint32_t bounce) {
    const V8 reflectance = scene_.reflectance(surface.material, lanes);
    lanes = lanes & (max_component(reflectance) > F8(0.0f));
    if (lanes.none()) {
      return;
    }
    const V8 origin = surface.point + facing * surface.offset;
    if (scene_.features().lights) {
      sample_light(in, origin, facing, frame, reflectance, lanes, bounce);
    }
    const bool split_here = bounce == 0 && plan_.splits > 1;
    const std::uint32_t splits = split_here ? plan_.splits : 1;
    for (std::uint32_t split = 0; split < splits; ++split) {
      // From the first diffuse surface on, a path has a point of its own in every sequence.
      const U8 index = bounce == 0 ? U8(plan_.split_index + split) : in.index;
      const Pair8 u = decide(index, in.pixel_seed, bounce, bsdf_decision(bounce));
      const BsdfSample8 s = diffuse::sample(reflectance, u);
      Path8 out = in;
      out.index = index;
      out.slot = in.slot + U8(split * pixels_);
      out.origin = origin;
      out.direction = frame.to_world(s.wi);
      out.throughput = in.throughput * s.weight * F8(1.0f / static_cast<float>(splits));
      out.pdf_solid_angle = s.pdf_solid_angle;
      out.roulette_scale = in.roulette_scale * F8(static_cast<float>(splits));
      go_on(out, lanes & (dot(out.direction, facing) > F8(0.0f)), bounce);
    }
  }

  void sample_light(const Path8& in, const V8& origin, const V8& facing, const Frame8& frame, const V8& reflectance,
                    M8 lanes, std::uint32_t bounce) {
    const F8 choice =
        scene_.lights().size() > 1 ? decide(in.index, in.pixel_seed, bounce, choice_decision(bounce)).u : F8(0.0f);
    const Pair8 u = decide(in.index, in.pixel_seed, bounce, light_decision(bounce));
    const LightSample8 light = scene_.lights().sample(origin, choice, u);
    const V8 wi = frame.to_local(light.wi);
    const M8 valid = lanes & light.valid & (wi.z > F8(0.0f)) & (dot(light.wi, facing) > F8(0.0f));
    if (valid.none()) {
      return;
    }
    const F8 weight = select(light.pdf_solid_angle > F8(0.0f),
                             mis_weight(light.pdf_solid_angle, diffuse::pdf_solid_angle(wi)), F8(1.0f));
    const V8 contribution = in.throughput * diffuse::eval(reflectance, wi) * light.weight * weight;
    ws_.shadows.push(valid, {origin, light.point - origin, contribution, in.slot});
  }

  void shade_mirror(const Path8& in, const Surface8& surface, const V8& facing, const Frame8& frame, M8 lanes,
                    std::uint32_t bounce) {
    const BsdfSample8 s = mirror::sample(scene_.reflectance(surface.material, lanes), frame.to_local(-in.direction));
    Path8 out = specular_start(in, bounce);
    out.direction = frame.to_world(s.wi);
    out.origin = surface.point + facing * surface.offset;
    out.throughput = in.throughput * s.weight;
    go_on(out, lanes & (dot(out.direction, facing) > F8(0.0f)), bounce);
  }

  void shade_dielectric(const Path8& in, const Surface8& surface, const V8& facing, const Frame8& frame, M8 lanes,
                        std::uint32_t bounce) {
    const F8 ior = scene_.ior(surface.material, lanes);
    const F8 eta = select(surface.front, ior, F8(1.0f) / ior);
    Path8 out = specular_start(in, bounce);
    const F8 u = decide(out.index, out.pixel_seed, bounce, bsdf_decision(bounce)).u;
    const dielectric::Sample8 s = dielectric::sample(frame.to_local(-in.direction), eta, u);
    out.direction = frame.to_world(s.wi);
    out.origin = surface.point + facing * select(s.refracted, -surface.offset, surface.offset);
    out.throughput = in.throughput * s.weight;
    out.roulette_scale = in.roulette_scale * select(s.refracted, eta * eta, F8(1.0f));
    const M8 on_right_side = ~((dot(out.direction, facing) > F8(0.0f)) & s.refracted) &
                             ~((dot(out.direction, facing) < F8(0.0f)) & ~s.refracted);
    go_on(out, lanes & on_right_side, bounce);
  }

  /// A path that starts with a delta BSDF is not split: its points are those of the sample, under scrambles of its own.
  static Path8 specular_start(const Path8& in, std::uint32_t bounce) {
    Path8 out = in;
    out.pdf_solid_angle = F8(0.0f);
    if (bounce == 0) {
      out.pixel_seed = mix(in.pixel_seed ^ U8(kUnsplitSalt));
    }
    return out;
  }

  /// Russian roulette from the second scattering on, then the queue.
  void go_on(Path8& out, M8 lanes, std::uint32_t bounce) {
    if (bounce > 0) {
      const F8 survival = max_component(out.throughput) * out.roulette_scale * F8(plan_.roulette_boost);
      const M8 at_risk = survival < F8(1.0f);
      if ((lanes & at_risk).any()) {
        const F8 u = hashed_number(out.index, decision_seed(out.pixel_seed, choice_decision(bounce)));
        lanes = lanes & ~(at_risk & (u >= survival));
        out.throughput = out.throughput * select(at_risk, F8(1.0f) / survival, F8(1.0f));
      }
    }
    if (lanes.any()) {
      ws_.next.push(lanes, out);
    }
  }

  void trace_shadows() {
    for (int i = 0; i < ws_.shadows.size(); i += 8) {
      const M8 lanes = first_lanes(ws_.shadows.size() - i);
      const Shadow8 s = ws_.shadows.load(i);
      const Ray8 rays{s.origin, s.direction, F8(1.0f)};
      add_untraceable(lanes, rays, s.slot);
      const M8 blocked = scene_.accel().occluded(lanes, rays);
      add_radiance(and_not(lanes, blocked), s.slot, s.contribution);
    }
    ws_.counters.shadow_rays += static_cast<std::uint64_t>(ws_.shadows.size());
  }

  const CompiledScene& scene_;
  const PixelRect& tile_;
  const SamplePlan& plan_;
  const std::uint32_t max_bounces_;
  PathWorkspace& ws_;
  const std::uint32_t pixels_;
  const std::uint32_t slots_;
};

class PathMethod final : public Method {
 public:
  PathMethod(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings)
      : scene_(std::move(scene)),
        seed_(settings.seed),
        max_bounces_(settings.max_bounces == 0 ? kMaxBounces : settings.max_bounces) {}

  std::unique_ptr<Workspace> make_workspace() const override {
    auto ws = std::make_unique<PathWorkspace>();
    const std::size_t capacity = kBatchPixels * SamplePlan(0).splits;
    ws->paths.reserve(capacity);
    ws->next.reserve(capacity);
    ws->shadows.reserve(capacity);
    return ws;
  }

  Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const override {
    const FixedFloatEnvironment float_environment;
    auto& ws = static_cast<PathWorkspace&>(workspace);
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    ws.sums.start(range, pixels);
    for (std::uint32_t half = 0; half < 2; ++half) {
      fill_pixel_seeds(tile, seed_, half, ws.pixel_seeds[half]);
    }
    for (std::uint64_t sample = range.first(); sample < range.end(); ++sample) {
      const SamplePlan plan(sample);
      ws.radiance.assign(3 * pixels * plan.splits, 0.0f);
      Batch batch(*scene_, tile, plan, max_bounces_, ws);
      for (std::size_t first = 0; first < pixels; first += kBatchPixels) {
        batch.run(first, std::min(first + kBatchPixels, pixels), ws.pixel_seeds[sample & 1]);
      }
      sum_splits(ws.radiance, pixels, plan.splits);
      ws.sums.add(std::span(ws.radiance).first(3 * pixels));
    }
    ws.counters.samples += pixels * range.count();
    return ws.sums.finish();
  }

 private:
  /// From planes of one value a slot to planes of one value a pixel, split paths added in ascending order.
  static void sum_splits(std::vector<float>& planes, std::size_t pixels, std::size_t splits) {
    for (std::size_t channel = 0; splits > 1 && channel < 3; ++channel) {
      const float* const from = planes.data() + channel * splits * pixels;
      float* const to = planes.data() + channel * pixels;  // at or before what it reads, which is not needed again
      for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        float sum = from[pixel];
        for (std::size_t split = 1; split < splits; ++split) {
          sum += from[split * pixels + pixel];
        }
        to[pixel] = sum;
      }
    }
  }

  std::shared_ptr<const CompiledScene> scene_;
  std::uint64_t seed_;
  std::uint32_t max_bounces_;
};

}  // namespace

std::unique_ptr<Method> make_path_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings) {
  return std::make_unique<PathMethod>(std::move(scene), settings);
}

}  // namespace lightmill
