// What stands where in a glTF scene.
#pragma once

#include <vector>

#include "common/scene/document.h"
#include "common/scene_io/gltf/gltf_data.h"

namespace lightmill {

/// A node of the scene and where it stands.
struct PlacedNode {
  JsonNode node;
  Transform to_scene;

  Point3d origin() const { return {to_scene[0][3], to_scene[1][3], to_scene[2][3]}; }
  /// The node's own axis (0: x, 1: y, 2: z), times `sign`; its length is the node's scale.
  Point3d axis(std::size_t which, double sign = 1) const {
    return {sign * to_scene[0][which], sign * to_scene[1][which], sign * to_scene[2][which]};
  }
};

/// The nodes of the file's scene (of all its trees, if it names none), parents before children. A node that stands in
/// the scene twice is a mistake. Empty after a mistake.
std::vector<PlacedNode> placed_nodes(const GltfData& data);

/// a after b.
Transform compose(const Transform& a, const Transform& b);

Point3d transformed(const Transform& t, const Point3d& p);

}  // namespace lightmill
