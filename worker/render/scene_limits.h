// What one scene may take of a worker.
#pragma once

#include <cstdint>

#include "common/base/status.h"
#include "common/image/decoder/decoder_process.h"
#include "common/image/texels.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// One that is beyond is refused with RESOURCE_EXHAUSTED and the setting's name.
struct SceneLimits {
  std::uint64_t bytes = std::uint64_t{16} << 30;        ///< while it is compiled, as estimated before
  std::uint64_t triangles = kMaxSceneTriangles;         ///< instances of a mesh count once
  std::int64_t image_pixels = kMaxTexturePixels;        ///< of one image, decoded
  std::uint64_t images_bytes = std::uint64_t{8} << 30;  ///< of all, decoded
};

/// Before anything is decoded: a worker whose memory ends is killed, and takes with it what others had it render.
Status check_memory(const Scene& scene, const CompiledScene::AssetSource& assets, DecoderProcess& images,
                    std::uint64_t max_bytes);

}  // namespace lightmill
