// The decoded images of a scene: their memory limit, and its textures.
#pragma once

#include <cstdint>
#include <string>

#include "common/materials/texture.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// The memory limit of all decoded images of a scene together.
class ImageBudget {
 public:
  explicit ImageBudget(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Counts an image. Fails if all together exceed the limit, and names `where`.
  Status take(std::uint64_t bytes, const std::string& where) {
    bytes_ += bytes;
    return bytes_ <= max_bytes_
               ? ok_status()
               : resource_exhausted(
                     "{}: the scene's images need more than the worker's limit of {:.4g} GiB (--images-gib)", where,
                     static_cast<double>(max_bytes_) / (1 << 30));
  }

 private:
  std::uint64_t max_bytes_;
  std::uint64_t bytes_ = 0;
};

/// The textures in the order of Scene::textures. Textures with one asset share its pixels. Fails if an asset is missing
/// or damaged, or the budget is too small. Errors name the texture.
Result<TextureSet> load_textures(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 const CompiledScene::ImageDecoder& images, ImageBudget& budget);

}  // namespace lightmill
