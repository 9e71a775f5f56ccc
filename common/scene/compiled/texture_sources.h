// The textures of a scene, decoded.
#pragma once

#include "common/materials/texture.h"
#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/image_budget.h"

namespace lightmill {

/// In the order of Scene::textures; textures of one asset share its pixels. Fails where an asset is missing or damaged,
/// or the budget does not suffice; errors name the texture.
Result<TextureSet> load_textures(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 const CompiledScene::ImageDecoder& images, ImageBudget& budget);

}  // namespace lightmill
