// How much memory a scene will take while it is compiled and rendered, told from its document and the headers of its
// assets, before anything is decoded.
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
  std::uint64_t bytes = 0;      ///< at the highest point, the assets' files apart
  std::uint64_t triangles = 0;  ///< that are held: instances of a mesh count once
  std::string largest;          ///< what takes the most of it, by name
  std::uint64_t largest_bytes = 0;
};

/// From 1.05 to 1.65 times what scenes with large meshes and images were seen to take (docs/evidence/speed.md). Errors
/// of the asset source are passed on. Meshes and images that cannot be read count nothing: compiling says what is
/// wrong.
Result<SceneMemory> estimate_memory(const Scene& scene, const CompiledScene::AssetSource& assets,
                                    const ImageSizer& sizes);

}  // namespace lightmill
