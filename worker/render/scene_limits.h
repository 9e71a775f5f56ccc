// Limits of one scene on a worker.
#pragma once

#include <cstdint>

#include "common/base/status.h"
#include "common/image/decoder/decoder_process.h"
#include "common/image/texels.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// A scene beyond a limit is refused with RESOURCE_EXHAUSTED and the name of the setting.
struct SceneLimits {
  std::uint64_t bytes = std::uint64_t{16} << 30;        ///< estimate for compiling, made before it starts
  std::uint64_t triangles = kMaxSceneTriangles;         ///< instances of a mesh count once
  std::int64_t image_pixels = kMaxTexturePixels;        ///< of one decoded image
  std::uint64_t images_bytes = std::uint64_t{8} << 30;  ///< of all decoded images
  double seconds = 600;                                 ///< to prepare it, without the time in which assets arrive
};

/// Checks the memory before anything is decoded. The system kills a worker that runs out of memory, and other jobs on
/// it lose their results.
Status check_memory(const Scene& scene, const CompiledScene::AssetSource& assets, DecoderProcess& images,
                    std::uint64_t max_bytes);

}  // namespace lightmill
