// Triangles of a glTF mesh.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/scene/mesh.h"
#include "common/scene_io/gltf/gltf_data.h"

namespace lightmill {

/// What was left out or assumed, each thing once.
class Notices {
 public:
  explicit Notices(std::vector<std::string>& list) : list_(list) {}
  void once(std::string notice);
  void left_out(std::string_view what) { once(fmt::format("left out: {}", what)); }

 private:
  std::vector<std::string>& list_;
};

/// The triangles of meshes[…].primitives[…], with the texture coordinates of this set if there is one. Nothing if it
/// has none (points, lines), which is a notice, or after a mistake. Texture coordinates are turned over: v grows
/// upwards (mesh.h), not downwards as in glTF.
std::optional<Mesh> read_primitive(const GltfData& data, const JsonNode& primitive,
                                   std::optional<std::uint64_t> texture_set, Notices& notices);

}  // namespace lightmill
