// Lights and cameras of a glTF file.
#pragma once

#include "common/scene_io/gltf/gltf_mesh.h"
#include "common/scene_io/gltf/gltf_nodes.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// The light of a node (KHR_lights_punctual), if it has one and its type is known. 683 lm/W converts candelas and lux to W/sr and W/m².
std::optional<Light> read_light(const GltfData& data, const PlacedNode& placed, Notices& notices);

/// The camera of a node, if it has a perspective camera.
std::optional<NamedCamera> read_camera(const GltfData& data, const PlacedNode& placed, Notices& notices);

}  // namespace lightmill
