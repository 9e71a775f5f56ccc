// `whitted`: `raycast`, also seen through mirrors and smooth metal, glass and coats (Whitted 1980, "An Improved
// Illumination Model for Shaded Display").
//
// At glass both branches are followed. Fresnel's equations weight them, or the reflectance of `glass=R`. Total internal
// reflection stays in both cases. A branch ends below a weight of 1e-5, or after max_bounces reflections and
// refractions (at most 128). A camera ray has at most 4096 branches. Media absorb along all segments.
//
// Parameters
//   glass=R           reflectance of smooth glass (default: by Fresnel's equations)
//   flat              surfaces are shaded with their geometric normals
//   brute-force       rays test every triangle
//   --max-bounces N   reflections and refractions of a branch (default and maximum 128)
//
// Weaknesses
//   - Indirect light between surfaces is missing, and so is light that media scatter.
//   - All shadows are hard, also those of glass.
//   - Rough metal, glass and coats are shaded as in `raycast`, without reflections. Where a roughness texture makes
//     them smooth, reflections are followed.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method whitted --spp 16 -o balls.exr
#include "common/methods/factories.h"

#include "common/materials/dielectric.h"
#include "common/methods/camera_method.h"
#include "common/methods/raycast/local_shading.h"
#include "common/methods/surface_bsdf.h"

namespace lightmill {
namespace {

constexpr float kMinWeight = 1e-5f;
constexpr std::uint32_t kMaxBranches = 4096;  ///< of one camera ray; glass between mirrors has no end of branches

/// Eight rays to be traced. Each stays in the lane of its camera ray, where its light is added.
struct Branch8 {
  M8 lanes;
  Ray8 rays;
  V8 weight;                  ///< of their radiance in the camera ray's radiance
  Media8 media;               ///< in scenes with media
  std::uint32_t scatterings;  ///< before
};

class WhittedShader {
 public:
  WhittedShader(const CompiledScene& scene, const MethodSpec& spec, std::uint32_t max_bounces)
      : scene_(&scene),
        shading_(scene, spec.flat),
        fixed_reflectance_(spec.glass),
        max_scatterings_(max_bounces == 0 ? kMaxWhittedBounces : max_bounces) {
    for (const MaterialKind kind : scene.materials().kinds()) {
      may_be_smooth_ |= kind != MaterialKind::diffuse && kind != MaterialKind::rough_diffuse &&
                        kind != MaterialKind::diffuse_transmission && kind != MaterialKind::phong &&
                        kind != MaterialKind::shadow_catcher;
    }
  }

  V8 shade(const CameraHit8& at, RenderCounters& counters) const {
    Walk walk{{}, {}, {}, counters};
    arrive({at.lanes, at.arrival.rays, broadcast(Vec3(1)), at.arrival.media, 0}, at.arrival, at.surface, walk);
    // Depth first, so the order of addition in a lane depends only on its own branches.
    while (!walk.waiting.empty()) {
      const Branch8 branch = walk.waiting.back();
      walk.waiting.pop_back();
      const Arrival8 arrival = trace_transmittance(*scene_, branch.lanes, branch.rays, branch.media,
                                                   at.passing(*scene_, branch.scatterings), kNoGeometry, counters);
      arrive(branch, arrival, scene_->surface(arrival.rays, arrival.hits, at.part(*scene_, branch.scatterings)), walk);
    }
    return walk.sum;
  }

 private:
  struct Walk {
    V8 sum;  ///< radiance of the camera rays
    std::vector<Branch8> waiting;
    U8 branches;  ///< queued so far
    RenderCounters& counters;
  };

  void arrive(const Branch8& branch, const Arrival8& arrival, const Surface8& surface, Walk& walk) const {
    const M8 hit = arrival.hits.hit;
    const V8 weight = branch.weight * arrival.transmittance;
    V8 light = shading_.background(arrival.rays.direction, and_not(branch.lanes, hit));
    if (hit.any()) {
      const LitVertex8 vertex = shading_.vertex(arrival, surface);
      light = light + shading_.emission(vertex, hit);
      if (branch.scatterings < max_scatterings_) {
        light = light + shading_.scattered(vertex, hit, walk.counters);
        if (may_be_smooth_) {
          follow(vertex, hit, weight, branch.scatterings + 1, walk);
        }
      }
    }
    walk.sum = walk.sum + masked(branch.lanes, light * weight + arrival.emission * branch.weight);
    // Only degenerate geometry makes rays untraceable. The sample becomes NaN, so that the film counts it.
    if (const M8 lost = and_not(branch.lanes, Accel::traceable(branch.rays)); lost.any()) [[unlikely]] {
      walk.sum = select(lost, broadcast(Vec3(std::numeric_limits<float>::quiet_NaN())), walk.sum);
    }
  }

  /// Queues the branches of smooth lobes.
  void follow(const LitVertex8& vertex, M8 lanes, const V8& weight, std::uint32_t scatterings, Walk& walk) const {
    const V8 wo = vertex.wo(-vertex.direction);
    const F8 eta = relative_index(*scene_, vertex.surface, vertex.crossing, lanes);
    dielectric::Fresnel8 fresnel = dielectric::fresnel(wo.z, eta);
    if (fixed_reflectance_) {
      const M8 total = fresnel.cos_refracted <= F8(0.0f);
      fresnel.reflectance = select(total, F8(1.0f), F8(static_cast<float>(*fixed_reflectance_)));
    }
    DeltaLobes8 lobes;
    for_each_kind(scene_->materials(), vertex.surface, lanes, [&](MaterialKind kind, M8 of_kind) {
      const DeltaLobes8 of_these = delta_lobes(kind, vertex, wo, fresnel, eta, of_kind);
      lobes = {select(of_kind, of_these.reflected, lobes.reflected),
               select(of_kind, of_these.refracted, lobes.refracted)};
    });
    const F8 inverse_eta = F8(1.0f) / eta;
    const V8 through{-(wo.x * inverse_eta), -(wo.y * inverse_eta), -fresnel.cos_refracted};
    push<true>(vertex, lanes, through, weight * lobes.refracted, scatterings, walk);
    push<false>(vertex, lanes, {-wo.x, -wo.y, wo.z}, weight * lobes.reflected, scatterings, walk);
  }

  /// The smooth lobes, which LocalShading leaves out.
  DeltaLobes8 delta_lobes(MaterialKind kind, const LitVertex8& vertex, const V8& wo,
                          const dielectric::Fresnel8& fresnel, F8 eta, M8 lanes) const {
    const MaterialTable& materials = scene_->materials();
    switch (kind) {
      case MaterialKind::mirror:
        return {materials.reflectance(vertex.surface, lanes), V8()};
      case MaterialKind::conductor:
      case MaterialKind::rough_conductor:
        return materials.conductor(vertex.surface, lanes).smooth(wo);
      case MaterialKind::dielectric:
      case MaterialKind::rough_dielectric:
        return materials.dielectric(vertex.surface, eta, lanes).smooth(fresnel);
      case MaterialKind::principled:
        return shading_.principled(vertex, wo, lanes).smooth(wo, fresnel);
      case MaterialKind::diffuse:
      case MaterialKind::rough_diffuse:
      case MaterialKind::diffuse_transmission:
      case MaterialKind::phong:
      case MaterialKind::shadow_catcher:
      case MaterialKind::mixture:
        break;
    }
    return {};
  }

  template <bool kTransmitted>
  void push(const LitVertex8& vertex, M8 lanes, const V8& wi, const V8& weight, std::uint32_t scatterings,
            Walk& walk) const {
    V8 direction = vertex.frame.to_world(wi);
    // A branch ends if both normals disagree on its side of the surface.
    const M8 wrong = vertex.turn(direction, M8(kTransmitted));
    lanes = and_not(lanes, wrong | (max_component(weight) < F8(kMinWeight)));
    lanes = lanes & signed_less(walk.branches, U8(kMaxBranches));
    if (lanes.any()) {
      walk.branches = walk.branches + select(lanes, U8(1u), U8(0u));
      const F8 offset = kTransmitted ? -vertex.surface.offset : vertex.surface.offset;
      const Ray8 rays{vertex.surface.point + vertex.facing * offset, direction,
                      F8(std::numeric_limits<float>::infinity())};
      walk.waiting.push_back({lanes, rays, weight, kTransmitted ? vertex.crossing.beyond : vertex.media, scatterings});
    }
  }

  const CompiledScene* scene_;
  LocalShading shading_;
  std::optional<double> fixed_reflectance_;
  std::uint32_t max_scatterings_;
  bool may_be_smooth_ = false;
};

}  // namespace

std::unique_ptr<Method> make_whitted_method(ScenePointer scene, const MethodSettings& settings,
                                            const MethodSpec& spec) {
  WhittedShader shader(*scene, spec, settings.max_bounces);
  return make_camera_method(std::move(scene), settings, std::move(shader), spec.flat);
}

}  // namespace lightmill
