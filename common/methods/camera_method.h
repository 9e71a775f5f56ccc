// Base of methods that shade each camera ray independently: everything but the shading.
#pragma once

#include "common/methods/camera_rays.h"
#include "common/methods/sampled_method.h"
#include "common/methods/texture_footprint.h"
#include "common/methods/transmittance.h"

namespace lightmill {

/// Eight camera rays and the surfaces that they reach, behind medium boundaries that do not affect light.
struct CameraHit8 {
  M8 lanes;  ///< lanes with a ray
  Arrival8 arrival;
  Surface8 surface;
  U8 pixel_seed;        ///< scramble of the pixel in this half
  std::uint32_t index;  ///< point of its sequences. Decisions are numbered from kFirstPathDecision

  /// The decision of a ray that starts at this vertex, counted from the camera.
  Passing8 passing(const CompiledScene& scene, std::uint32_t vertex) const {
    if (!scene.features().opacity) {
      return {};
    }
    return Passing8::decided_by(sobol_pair(U8(index), decision_seed(pixel_seed, opacity_decision(vertex))).u);
  }
  /// The number that draws a part of mixtures at this vertex.
  std::optional<F8> part(const CompiledScene& scene, std::uint32_t vertex) const {
    if (!scene.features().mixtures) {
      return std::nullopt;
    }
    return sobol_pair(U8(index), decision_seed(pixel_seed, mixture_decision(vertex))).u;
  }
};

/// `Shader` is immutable. `V8 shade(const CameraHit8&, RenderCounters&) const` returns radiance in the lanes. The
/// optional `add(const PixelRect& tile, float* planes, Workspace&) const` adds to a sample of a whole tile: three
/// planes of one value per pixel.
template <class Shader>
class CameraMethod final : public SampledMethod {
 public:
  /// `flat`: directly visible surfaces have their geometric normals as shading normals.
  CameraMethod(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings, Shader shader, bool flat)
      : SampledMethod(std::move(scene), settings), shader_(std::move(shader)), flat_(flat) {}

  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<SampleWorkspace>(); }

 private:
  void render_sample(const PixelRect& tile, std::uint64_t sample, std::uint64_t /*end*/,
                     SampleWorkspace& ws) const override {
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    ws.radiance.assign(channels_.layout.summed * pixels, 0.0f);
    for (std::size_t pixel = 0; pixel < pixels && !ws.stop.stop_requested(); pixel += 8) {
      CameraHit8 hit;
      hit.lanes = first_lanes(static_cast<int>(pixels - pixel));
      hit.pixel_seed = U8::load(&ws.pixel_seeds[sample & 1][pixel]);
      hit.index = static_cast<std::uint32_t>(sample >> 1);
      const U8 pixel_lanes = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
      hit.arrival = arrive(hit, sample_camera_rays(*scene_, tile, pixel_lanes, hit.pixel_seed, hit.index), ws.counters);
      hit.surface = scene_->surface(hit.arrival.rays, hit.arrival.hits, hit.part(*scene_, 0));
      if (scene_->features().footprints) {
        const Ray8& rays = hit.arrival.rays;
        const F8 width = camera_width(*scene_, rays.direction, hit.arrival.hits.distance);
        hit.surface.footprint = texture_footprint(*scene_, hit.arrival.hits, hit.surface, rays.direction, width);
      }
      if (flat_) {
        hit.surface.shading_normal = hit.surface.geometric_normal;
      }
      if (channels_.shows_surfaces()) {
        store_surfaces(channels_, *scene_, hit.arrival.hits, hit.surface, pixel_lanes,
                       {ws.radiance.data(), pixels, ws.first.empty() ? nullptr : ws.first.data(), pixels});
      }
      V8 value = shader_.shade(hit, ws.counters);
      if (scene_->features().media) {
        const V8 nothing_known = broadcast(Vec3(std::numeric_limits<float>::quiet_NaN()));
        value = select(MediumTable::overfull(hit.arrival.media), nothing_known, value);
      }
      store(value, pixel, pixels, ws.radiance);
    }
    if constexpr (requires { shader_.add(tile, ws.radiance.data(), ws); }) {
      shader_.add(tile, ws.radiance.data(), ws);
    }
  }

  Arrival8 arrive(const CameraHit8& at, const Ray8& rays, RenderCounters& counters) const {
    Passing8 passing = at.passing(*scene_, 0);
    if (scene_->features().media) {
      return trace_transmittance(*scene_, at.lanes, rays, scene_->camera_media(), passing, kNoGeometry, counters);
    }
    counters.closest_hit_rays += static_cast<std::uint64_t>(at.lanes.count());
    return {nearest_stop(*scene_, at.lanes, rays, true, passing, counters), rays, {}, {}, broadcast(Vec3(1)), {}};
  }

  static void store(const V8& value, std::size_t pixel, std::size_t pixels, std::vector<float>& planes) {
    const std::size_t count = std::min<std::size_t>(8, pixels - pixel);
    float* to = planes.data() + pixel;
    for (const F8& component : {value.x, value.y, value.z}) {
      alignas(32) float lanes[8];
      component.store(lanes);
      std::copy_n(lanes, count, to);
      to += pixels;
    }
  }

  Shader shader_;
  bool flat_;
};

/// The method of a shader for this scene. `flat`: as in CameraMethod.
template <class Shader>
std::unique_ptr<Method> make_camera_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                           Shader shader, bool flat = false) {
  return std::make_unique<CameraMethod<Shader>>(std::move(scene), settings, std::move(shader), flat);
}

}  // namespace lightmill
