// The scene document: plain values ↔ lightmill.v1.Scene, and its packed form, whose bytes enter the render digest.
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

/// Fills an empty message with the scene; every default is written out. Angles are in degrees, cameras by their field
/// of view.
void to_wire(const Scene& scene, v1::Scene* out);

/// A scene as a document file holds it, before its assets are read.
struct SceneDraft {
  Scene scene;  ///< meshes have no asset yet
  /// One per object: a mesh that names no material, so that its faces choose theirs. Its `material` is 0 until then.
  std::vector<bool> material_by_face;
};

/// The scene of a document file: materials by name, defaults as scene.proto says, no assets. Everything that can be
/// said about it without its files is checked (see validate); errors begin with the path of the field.
Result<SceneDraft> draft_from_wire(const v1::Scene& scene);
Result<Camera> from_wire(const v1::Camera& camera);

/// The scene of a packed document: like a draft, but each mesh has its asset and each object its material.
Result<Scene> from_wire(const v1::Scene& scene);

/// The packed form: equal scenes give equal bytes, on every machine. The scene must be valid.
std::string pack_scene(const Scene& scene);

/// The inverse. Never trusts the bytes: everything is checked.
Result<Scene> unpack_scene(std::string_view bytes);

}  // namespace lightmill
