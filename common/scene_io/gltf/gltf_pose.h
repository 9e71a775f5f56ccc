// Poses of a glTF file's nodes at a moment of an animation, and the joints of skins.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/scene_io/gltf/gltf_data.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Properties of a node that an animation sets. The others keep the node's values.
struct NodePose {
  std::optional<std::array<double, 3>> translation, scale;
  std::optional<std::array<double, 4>> rotation;  ///< x, y, z, w
  std::optional<std::vector<double>> weights;     ///< of morph targets
};

inline constexpr double kMaxWeight = 1e6;  ///< of a morph target

/// Poses by the path of their node. Nodes that no animation changes have none.
using GltfPoses = std::unordered_map<std::string, NodePose>;

/// The poses at a moment. Before its first keyframe, a channel has the value there, and after its last one the value
/// there. A channel with wrong values is a fault. INVALID_ARGUMENT if the file has no such animation.
Result<GltfPoses> poses_at(const GltfData& data, const AnimationMoment& moment);

/// Deformation of a node's mesh. None without weights and joints.
struct MeshPose {
  std::shared_ptr<const std::vector<double>> weights;    ///< of the morph targets; missing ones are 0. Null: none moves
  std::shared_ptr<const std::vector<Transform>> joints;  ///< maps from the mesh to the scene; null without a skin
  Transform to_scene = kIdentityTransform;               ///< of the node; with a skin, for primitives without joints

  bool deforms() const { return weights != nullptr || joints != nullptr; }
};

/// The joints of a skin: each maps the mesh to the scene. `places`: the nodes of the scene, by path. Null, with a
/// fault, if a joint is not in the scene.
std::shared_ptr<const std::vector<Transform>> joints_of(const GltfData& data, const JsonNode& skin,
                                                        const std::unordered_map<std::string, Transform>& places);

}  // namespace lightmill
