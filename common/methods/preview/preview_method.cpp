#include "common/methods/preview/preview_method.h"

#include "common/methods/film_channels.h"
#include "common/methods/float_environment.h"
#include "common/methods/primary_rays.h"
#include "common/methods/sample_sums.h"

namespace lightmill {
namespace {

class PreviewWorkspace final : public Workspace {
 public:
  SampleSums sums;
  std::vector<std::uint32_t> pixel_seeds;
  std::vector<float> radiance;  ///< planes of the summed channels
  std::vector<float> first;     ///< planes of layers that are made of samples 0 to 15
};

class PreviewMethod final : public Method {
 public:
  PreviewMethod(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings)
      : scene_(std::move(scene)), seed_(settings.seed), channels_(settings.layers) {}

  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<PreviewWorkspace>(); }

  Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const override {
    const FixedFloatEnvironment float_environment;
    auto& ws = static_cast<PreviewWorkspace&>(workspace);
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    ws.sums.start(range, pixels, channels_.layout);
    for (std::uint64_t sample = range.first(); sample < range.end(); ++sample) {
      fill_pixel_seeds(tile, seed_, sample & 1, ws.pixel_seeds);
      ws.radiance.assign(channels_.layout.summed * pixels, 0.0f);
      ws.first.assign(sample < kFirstSamples ? channels_.layout.first_values(1) * pixels : 0, 0.0f);
      render_sample(tile, static_cast<std::uint32_t>(sample >> 1), pixels, ws);
      ws.sums.add(ws.radiance, ws.first);
    }
    ws.counters.samples += pixels * range.count();
    ws.counters.closest_hit_rays += pixels * range.count();
    return ws.sums.finish();
  }

 private:
  void render_sample(const PixelRect& tile, std::uint32_t index, std::size_t pixels, PreviewWorkspace& ws) const {
    for (std::size_t pixel = 0; pixel < pixels; pixel += 8) {
      const M8 lanes = first_lanes(static_cast<int>(pixels - pixel));
      const U8 pixel_lanes = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
      const Ray8 rays = primary_rays(*scene_, tile, pixel_lanes, U8::load(&ws.pixel_seeds[pixel]), index);
      const Hit8 hits = scene_->accel().intersect(lanes, rays, true);
      const Surface8 surface = scene_->surface(rays, hits);
      const V8 value = masked(hits.hit, scene_->materials().reflectance(surface, hits.hit)) +
                       scene_->materials().emission(surface, scene_->materials().emits(surface, hits.hit));
      if (channels_.shows_surfaces()) {
        store_surfaces(channels_, *scene_, hits, surface, pixel_lanes,
                       {ws.radiance.data(), pixels, ws.first.empty() ? nullptr : ws.first.data(), pixels});
      }
      alignas(32) float plane[8];
      int channel = 0;
      for (const F8& c : {value.x, value.y, value.z}) {
        c.store(plane);
        const std::size_t count = std::min<std::size_t>(8, pixels - pixel);
        std::copy_n(plane, count, ws.radiance.begin() + static_cast<std::ptrdiff_t>(channel * pixels + pixel));
        ++channel;
      }
    }
  }

  std::shared_ptr<const CompiledScene> scene_;
  std::uint64_t seed_;
  FilmChannels channels_;
};

}  // namespace

std::unique_ptr<Method> make_preview_method(std::shared_ptr<const CompiledScene> scene,
                                            const MethodSettings& settings) {
  return std::make_unique<PreviewMethod>(std::move(scene), settings);
}

}  // namespace lightmill
