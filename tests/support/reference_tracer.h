// The reference: a simple scalar path tracer that shares only the document with the renderer.
//
// It traces single rays with Embree and uses independent random numbers. Diffuse surfaces use only next-event
// estimation, without weights. Russian roulette starts at the second bounce with survival = max throughput. It is slow
// and simple on purpose.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/base/status.h"
#include "common/film/tile_grid.h"
#include "common/scene/document.h"
#include "common/scene/mesh.h"

namespace lightmill::test {

class ReferenceTracer {
 public:
  using AssetSource = std::function<Result<std::string>(const Sha256&)>;
  ReferenceTracer(const Scene& scene, const AssetSource& assets);
  ~ReferenceTracer();

  /// Means of `samples` samples with a box filter, RGB interleaved, row by row; `max_bounces` 0: no limit.
  std::vector<float> render(const PixelRect& rect, int samples, std::uint64_t seed,
                            std::uint32_t max_bounces = 0) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightmill::test
