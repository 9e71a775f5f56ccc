// Conversion of the scene document between plain values and lightmill.v1.Scene, and its packed form. The packed bytes
// enter the render digest.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/scene/document.h"

namespace lightmill::v1 {
class Camera;
class Scene;
}  // namespace lightmill::v1

namespace lightmill {

/// Fills an empty message with the scene, with every default. Angles are in degrees. Cameras have their field of view.
void to_wire(const Scene& scene, v1::Scene* out);

/// A scene from a document file, before its assets are read.
struct SceneDraft {
  Scene scene;  ///< meshes have no asset yet
  /// One per object: whether it is a mesh without a material, whose faces name theirs. Its `material` is 0 until then.
  std::vector<bool> material_by_face;
};

/// The scene of a document file: materials by name, defaults as in scene.proto, no assets. Checks everything that needs
/// no files (see validate). Errors begin with the path of the field.
Result<SceneDraft> draft_from_wire(const v1::Scene& scene);
Result<Camera> from_wire(const v1::Camera& camera);

/// The scene of a packed document. Unlike in a draft, each mesh has its asset and each object its material.
Result<Scene> from_wire(const v1::Scene& scene);

/// The packed form. Equal scenes give equal bytes on every machine. The scene must be valid.
std::string pack_scene(const Scene& scene);

/// Entries of a packed document: materials, textures, objects, lights and meters together. Reads only their lengths.
std::size_t count_entries(std::string_view packed);

/// The inverse. It checks everything.
Result<Scene> unpack_scene(std::string_view bytes);

}  // namespace lightmill
