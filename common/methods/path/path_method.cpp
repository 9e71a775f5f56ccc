#include "common/methods/path/path_method.h"

#include "common/methods/float_environment.h"
#include "common/methods/path/batch.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {
namespace {

using path::Batch;
using path::kBatchPixels;
using path::PathWorkspace;
using path::SamplePlan;

std::uint32_t bounce_limit(const MethodSettings& settings) {
  return settings.max_bounces == 0 ? kMaxBounces : settings.max_bounces;
}

class PathMethod final : public Method {
 public:
  PathMethod(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
             std::unique_ptr<const photons::LightSide> light_side, std::uint32_t connections_at_once,
             const path::Constants& constants = {})
      : scene_(std::move(scene)),
        seed_(settings.seed),
        max_bounces_(bounce_limit(settings)),
        channels_(settings.layers, scene_->light_groups()),
        light_side_(std::move(light_side)),
        connections_at_once_(light_side_ == nullptr ? 0 : connections_at_once),
        constants_(constants) {}

  std::unique_ptr<Workspace> make_workspace() const override {
    auto ws = std::make_unique<PathWorkspace>();
    const std::size_t capacity = kBatchPixels * constants_.splits;
    for (path::PathQueue* const queue : {&ws->paths, &ws->next}) {
      queue->reserve(capacity, scene_->features().media, light_side_ != nullptr && !connects(), connects());
    }
    ws->shadows.reserve(capacity, scene_->features().media);
    if (connects()) {
      ws->connections.reserve(connections_at_once_);
    }
    return ws;
  }

  Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const override {
    const FixedFloatEnvironment float_environment;
    auto& ws = static_cast<PathWorkspace&>(workspace);
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    ws.sums.start(range, pixels, channels_.layout);
    for (std::uint32_t half = 0; half < 2; ++half) {
      fill_pixel_seeds(tile, seed_, half, ws.pixel_seeds[half]);
    }
    for (std::uint64_t sample = range.first(); sample < range.end(); ++sample) {
      const SamplePlan plan(sample, constants_);
      const std::size_t channels = channels_.layout.summed;
      ws.radiance.assign(channels * pixels * plan.splits, 0.0f);
      ws.first.assign(sample < kFirstSamples ? channels_.layout.first_values(1) * pixels : 0, 0.0f);
      const auto light_pass = light_side_ == nullptr ? nullptr : light_side_->pass(sample, range.end(), ws);
      if (ws.stop.stop_requested()) {
        return {};
      }
      Batch batch(*scene_, channels_, tile, plan, max_bounces_, light_pass.get(), ws);
      for (std::size_t first = 0; first < pixels; first += kBatchPixels) {
        batch.run(first, std::min(first + kBatchPixels, pixels), ws.pixel_seeds[sample & 1]);
      }
      if (ws.stop.stop_requested()) {
        return {};  // its last batch ended early
      }
      if (light_pass != nullptr) {
        batch.add_light_pass();
      }
      sum_splits(ws.radiance, channels, pixels, plan.splits);
      ws.sums.add(std::span(ws.radiance).first(channels * pixels), ws.first);
    }
    ws.counters.samples += pixels * range.count();
    return ws.sums.finish();
  }

 private:
  /// From planes of one value a slot to planes of one value a pixel, split paths added in ascending order.
  static void sum_splits(std::vector<float>& planes, std::size_t channels, std::size_t pixels, std::size_t splits) {
    for (std::size_t channel = 0; splits > 1 && channel < channels; ++channel) {
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

  bool connects() const { return connections_at_once_ > 0; }

  std::shared_ptr<const CompiledScene> scene_;
  std::uint64_t seed_;
  std::uint32_t max_bounces_;
  FilmChannels channels_;
  std::unique_ptr<const photons::LightSide> light_side_;  ///< null: paths find all light
  std::uint32_t connections_at_once_;                     ///< of light paths with those from the eye; 0: none
  path::Constants constants_;
};

std::unique_ptr<Method> make_with_light_side(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                             const MethodSpec& spec, photons::Followed followed,
                                             std::uint32_t connections_at_once = 0) {
  auto light_side = std::make_unique<const photons::LightSide>(
      *scene, photons::LightSideSettings{settings.seed, bounce_limit(settings), spec.photons.value_or(0),
                                         spec.radius.value_or(0), followed, followed != photons::Followed::all_light});
  if (light_side->empty()) {
    light_side = nullptr;
  }
  return std::make_unique<PathMethod>(std::move(scene), settings, std::move(light_side), connections_at_once);
}

}  // namespace

std::unique_ptr<Method> make_path_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                         const path::Constants& constants) {
  return std::make_unique<PathMethod>(std::move(scene), settings, nullptr, 0, constants);
}

std::unique_ptr<Method> make_caustic_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                            const MethodSpec& spec) {
  return make_with_light_side(std::move(scene), settings, spec, photons::Followed::caustics);
}

std::unique_ptr<Method> make_vcm_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                        const MethodSpec& spec, std::uint32_t connections_at_once) {
  return make_with_light_side(std::move(scene), settings, spec, photons::Followed::paths, connections_at_once);
}

std::unique_ptr<Method> make_ppm_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                        const MethodSpec& spec) {
  return make_with_light_side(std::move(scene), settings, spec, photons::Followed::all_light);
}

}  // namespace lightmill
