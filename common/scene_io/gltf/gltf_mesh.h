// Reader of a glTF mesh's triangles.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/scene/mesh.h"
#include "common/scene_io/gltf/gltf_data.h"

namespace lightmill {

/// A list of what was left out or assumed, each thing once.
class Notices {
 public:
  explicit Notices(std::vector<std::string>& list) : list_(list) {}
  void once(std::string notice);
  void left_out(std::string_view what) { once(fmt::format("left out: {}", what)); }

 private:
  std::vector<std::string>& list_;
};

/// The triangles of meshes[…].primitives[…], with the texture coordinates of this set if there is one. `tangents`: with
/// those of the file, if it has some. Nothing after an error, or without triangles (points, lines), which gives a
/// notice. v is flipped: it grows upwards (mesh.h), but downwards in glTF.
std::optional<Mesh> read_primitive(const GltfData& data, const JsonNode& primitive,
                                   std::optional<std::uint64_t> texture_set, bool tangents, Notices& notices);

}  // namespace lightmill
