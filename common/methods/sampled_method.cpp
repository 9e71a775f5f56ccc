#include "common/methods/sampled_method.h"

#include "common/methods/camera_rays.h"
#include "common/methods/float_environment.h"

namespace lightmill {

Node SampledMethod::render(const PixelRect& tile, SampleRange range, Workspace& workspace) const {
  const FixedFloatEnvironment float_environment;
  auto& ws = static_cast<SampleWorkspace&>(workspace);
  const auto pixels = static_cast<std::size_t>(tile.pixel_count());
  ws.sums.start(range, pixels, channels_.layout);
  for (std::uint32_t half = 0; half < 2; ++half) {
    fill_pixel_seeds(tile, seed_, half, ws.pixel_seeds[half]);
  }
  for (std::uint64_t sample = range.first(); sample < range.end(); ++sample) {
    ws.first.assign(sample < kFirstSamples ? channels_.layout.first_values(1) * pixels : 0, 0.0f);
    render_sample(tile, sample, range.end(), ws);
    if (ws.stop.stop_requested()) {
      return {};
    }
    complete_features(channels_, sample % 2 == 1, pixels, ws.first);
    ws.sums.add(std::span(ws.radiance).first(channels_.layout.summed * pixels), ws.first);
  }
  ws.counters.samples += pixels * range.count();
  return ws.sums.finish();
}

}  // namespace lightmill
