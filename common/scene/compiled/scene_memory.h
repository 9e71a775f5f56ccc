// An estimate of the memory that a scene needs to compile and render. It needs only the document and the headers of the
// assets, not the decoded data.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/base/status.h"
#include "common/image/image_size.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Reads the header of an image file (common/image/read): its bytes and its name.
using ImageSizer = std::function<Result<ImageSize>(ByteView bytes, const std::string& name)>;

struct SceneMemory {
  std::uint64_t bytes = 0;      ///< at the peak, without the assets' files
  std::uint64_t triangles = 0;  ///< held; instances of a mesh count once
  std::string largest;          ///< name of the largest part
  std::uint64_t largest_bytes = 0;
};

/// 1.05 to 1.65 times the measured memory of scenes with large meshes and images (docs/evidence/speed.md). Passes on
/// errors of the asset source. Meshes and images that cannot be read count as 0: compiling reports them.
Result<SceneMemory> estimate_memory(const Scene& scene, const CompiledScene::AssetSource& assets,
                                    const ImageSizer& sizes);

}  // namespace lightmill
