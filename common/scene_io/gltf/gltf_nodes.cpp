#include "common/scene_io/gltf/gltf_nodes.h"

#include <cmath>

#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

/// A node's matrix, or its translation, rotation and scale (glTF 2.0, 3.5.2).
Transform local_transform(const JsonNode& node) {
  Transform out = kIdentityTransform;
  if (const JsonNode matrix = node["matrix"]; matrix.present()) {
    std::array<double, 16> identity{};
    for (int i = 0; i < 4; ++i) {
      identity[static_cast<std::size_t>(5 * i)] = 1;
    }
    const std::array<double, 16> m = matrix.numbers<16>(identity, -kMaxCoordinate, kMaxCoordinate);
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
      matrix.fail("the matrix of an affine map is expected: its last row must be 0, 0, 0, 1");
    }
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 4; ++column) {
        out[row][column] = m[4 * column + row];
      }
    }
    return out;
  }
  const auto t = node["translation"].numbers<3>({0, 0, 0}, -kMaxCoordinate, kMaxCoordinate);
  auto q = node["rotation"].numbers<4>({0, 0, 0, 1}, -1e6, 1e6);
  const auto s = node["scale"].numbers<3>({1, 1, 1}, -kMaxCoordinate, kMaxCoordinate);
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 1e-6)) {
    node["rotation"].fail("a unit quaternion is expected");
    return out;
  }
  for (double& value : q) {
    value /= length;
  }
  const auto [x, y, z, w] = q;
  const std::array<std::array<double, 3>, 3> rotation{
      {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
       {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
       {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      out[row][column] = rotation[row][column] * s[column];
    }
    out[row][3] = t[row];
  }
  return out;
}

/// The roots of the scene: indices of nodes, as written.
std::vector<JsonNode> roots(const GltfData& data) {
  const JsonNode root = data.root();
  std::vector<JsonNode> out;
  if (root["scenes"].size() > 0) {
    const JsonNode which = root["scene"];
    const JsonNode scene = which.present() ? data.element("scenes", which) : root["scenes"].at(0);
    const JsonNode nodes = scene["nodes"];
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      out.push_back(data.element("nodes", nodes.at(i)));
    }
    return out;
  }
  const JsonNode nodes = root["nodes"];
  std::vector<bool> is_child(nodes.size(), false);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const JsonNode children = nodes.at(i)["children"];
    for (std::size_t k = 0; k < children.size(); ++k) {
      if (const auto child = children.at(k).index("nodes", nodes.size())) {
        is_child[*child] = true;
      }
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!is_child[i]) {
      out.push_back(nodes.at(i));
    }
  }
  return out;
}

}  // namespace

std::vector<PlacedNode> placed_nodes(const GltfData& data) {
  std::vector<PlacedNode> out;
  std::set<std::string> seen;
  const auto place = [&](const JsonNode& node, const Transform& parent) {
    if (!node.present()) {
      return;
    }
    if (!seen.insert(node.path()).second) {
      node.fail("the node is in the scene twice");
      return;
    }
    out.push_back({node, compose(parent, local_transform(node))});
  };
  for (const JsonNode& node : roots(data)) {
    place(node, kIdentityTransform);
  }
  for (std::size_t i = 0; i < out.size() && data.status().ok(); ++i) {
    const PlacedNode parent = out[i];  // a copy: `out` grows
    const JsonNode children = parent.node["children"];
    for (std::size_t k = 0; k < children.size(); ++k) {
      place(data.element("nodes", children.at(k)), parent.to_scene);
    }
  }
  return data.status().ok() ? out : std::vector<PlacedNode>();
}

}  // namespace lightmill
