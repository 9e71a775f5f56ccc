// Base of methods that render a node sample by sample.
#pragma once

#include "common/methods/film_channels.h"
#include "common/methods/method.h"
#include "common/methods/sample_sums.h"

namespace lightmill {

struct SampleWorkspace : Workspace {
  SampleSums sums;
  std::array<std::vector<std::uint32_t>, 2> pixel_seeds;  ///< by half
  std::vector<float> radiance;  ///< one sample of the tile: planes of the summed channels, beauty first
  std::vector<float> first;     ///< planes of the layers of samples 0 to 15, one value per pixel
};

class SampledMethod : public Method {
 public:
  SampledMethod(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings)
      : scene_(std::move(scene)), channels_(settings.layers, scene_->light_groups()), seed_(settings.seed) {}

  Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const final;

 protected:
  /// Sets `radiance`, and adds to `first`, which is zero. `end`: end of the sample range.
  virtual void render_sample(const PixelRect& tile, std::uint64_t sample, std::uint64_t end,
                             SampleWorkspace& ws) const = 0;

  const std::shared_ptr<const CompiledScene> scene_;
  const FilmChannels channels_;

 private:
  const std::uint64_t seed_;
};

}  // namespace lightmill
