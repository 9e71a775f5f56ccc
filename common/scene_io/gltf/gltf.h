// glTF 2.0 scenes, as text (.gltf) and binary (.glb).
#pragma once

#include "common/scene_io/gltf/gltf_data.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Reads a glTF file: the nodes of its scene with their meshes (instances share theirs), materials (gltf_materials.h),
/// embedded and other images, punctual lights, and perspective cameras, of which the first is the scene's. A file
/// without a camera gets one that sees all of it, and, if `light_the_dark`, one in which nothing emits light an even
/// white sky; notices say so, and what was left out. Errors read "model.gltf: accessors[3].count: …".
Result<LoadedScene> read_gltf(std::string bytes, const std::string& file_name, bool light_the_dark, FileSource files);

}  // namespace lightmill
