// The nodes of a glTF scene: their places, lights and cameras.
#pragma once

#include <vector>

#include "common/scene/document.h"
#include "common/scene_io/gltf/gltf_data.h"
#include "common/scene_io/gltf/gltf_pose.h"
#include "common/scene_io/load.h"
#include "common/scene_io/notices.h"

namespace lightmill {

/// A node of the scene and its place.
struct PlacedNode {
  JsonNode node;
  Transform to_scene;

  Point3d origin() const { return {to_scene[0][3], to_scene[1][3], to_scene[2][3]}; }
  /// The node's own axis (0: x, 1: y, 2: z), times `sign`. Its length is the node's scale.
  Point3d axis(std::size_t which, double sign = 1) const {
    return {sign * to_scene[0][which], sign * to_scene[1][which], sign * to_scene[2][which]};
  }
};

/// The nodes of the file's scene in these poses, parents before children. All trees if the file names no scene. A node
/// that is in the scene twice is an error. Empty after an error.
std::vector<PlacedNode> placed_nodes(const GltfData& data, const GltfPoses& poses);

/// The light of a node (KHR_lights_punctual), if it has one and its type is known. 683 lm/W converts candelas and lux
/// to W/sr and W/m².
std::optional<Light> read_light(const GltfData& data, const PlacedNode& placed, Notices& notices);

/// The camera of a node, if it has a perspective camera.
std::optional<NamedCamera> read_camera(const GltfData& data, const PlacedNode& placed, Notices& notices);

}  // namespace lightmill
