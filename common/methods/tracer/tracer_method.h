// Method that renders nodes with a wavefront tracer and an estimator.
#pragma once

#include "common/methods/spec/method_spec.h"
#include "common/methods/tracer/tracer.h"

namespace lightmill::tracer {

/// Camera rays in flight: large enough for full lanes, small enough for the cache.
inline constexpr std::size_t kBatchPixels = 1024;

template <class Estimator>
class TracerMethod final : public SampledMethod {
 public:
  using Shared = typename Estimator::Shared;

  TracerMethod(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
               std::unique_ptr<const Shared> shared, const Constants& constants = {})
      : SampledMethod(std::move(scene), settings),
        max_bounces_(bounce_limit(settings.max_bounces)),
        shared_(std::move(shared)),
        constants_(constants) {}

  std::unique_ptr<Workspace> make_workspace() const override {
    auto ws = std::make_unique<typename Estimator::Workspace>(*shared_);
    const std::size_t capacity = kBatchPixels * constants_.splits;
    const bool media = scene_->features().media;
    ws->paths.reserve(capacity, media);
    ws->next.reserve(capacity, media);
    // A path can queue light that a medium scatters, and then light that a surface scatters.
    const std::size_t vertices = media && scene_->media().scatters() ? 2 : 1;
    ws->shadows.reserve(capacity * vertices * std::max(scene_->lights().draws(), 1u), media);
    return ws;
  }

 private:
  void render_sample(const PixelRect& tile, std::uint64_t sample, std::uint64_t end,
                     SampleWorkspace& workspace) const override {
    auto& ws = static_cast<typename Estimator::Workspace&>(workspace);
    Estimator estimator(*scene_, *shared_, sample, end, ws);
    if (ws.stop.stop_requested()) {
      return;
    }
    const SamplePlan plan(sample, constants_);
    Tracer<Estimator> tracer(*scene_, channels_, tile, plan, max_bounces_, estimator, ws);
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    for (std::size_t first = 0; first < pixels; first += kBatchPixels) {
      tracer.trace(first, std::min(first + kBatchPixels, pixels), ws.pixel_seeds[sample & 1]);
    }
    if (!ws.stop.stop_requested()) {  // otherwise the last batch ended early
      estimator.finish_sample(tracer);
      tracer.sum_splits();
    }
  }

  const std::uint32_t max_bounces_;
  const std::unique_ptr<const Shared> shared_;  ///< by all threads and tiles
  const Constants constants_;
};

}  // namespace lightmill::tracer
