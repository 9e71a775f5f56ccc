#include "common/scene_io/gltf/gltf_nodes.h"

#include <cmath>
#include <numbers>

#include "common/base/text.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

/// A node's matrix, or its translation, rotation and scale (glTF 2.0, 3.5.2).
Transform local_transform(const JsonNode& node, const NodePose& pose) {
  Transform out = kIdentityTransform;
  if (const JsonNode matrix = node["matrix"]; matrix.present()) {
    if (pose.translation || pose.rotation || pose.scale) {
      matrix.fault("a node with a matrix cannot be animated", "its animation is skipped");
    }
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
  const auto t = pose.translation.value_or(node["translation"].numbers<3>({0, 0, 0}, -kMaxCoordinate, kMaxCoordinate));
  auto q = pose.rotation.value_or(node["rotation"].numbers<4>({0, 0, 0, 1}, -1e6, 1e6));
  const auto s = pose.scale.value_or(node["scale"].numbers<3>({1, 1, 1}, -kMaxCoordinate, kMaxCoordinate));
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

std::vector<PlacedNode> placed_nodes(const GltfData& data, const GltfPoses& poses) {
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
    const auto pose = poses.find(node.path());
    out.push_back({node, compose(parent, local_transform(node, pose == poses.end() ? NodePose() : pose->second))});
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

namespace {

constexpr double kLumensPerWatt = 683;

std::string name_of(const PlacedNode& placed, const JsonNode& thing) {
  constexpr std::size_t kMaxBytes = 500;  // many nodes may share the thing
  const std::string node = placed.node["name"].text();
  return !node.empty() ? scene_name(node) : cut_text(thing["name"].text(), kMaxBytes);
}

/// The node's −z axis, along which its lights and cameras look. It must not be zero.
Point3d forward(const PlacedNode& placed) {
  const Point3d axis = placed.axis(2, -1);
  if (!(length(axis) > 1e-30)) {
    placed.node.fail("the node has a light or a camera, but its z scale is 0");
  }
  return axis;
}

}  // namespace

std::optional<Light> read_light(const GltfData& data, const PlacedNode& placed, Notices& notices) {
  constexpr std::string_view kExtension = "KHR_lights_punctual";
  const JsonNode index = placed.node["extensions"][kExtension]["light"].tolerant();
  if (!index.present()) {
    return std::nullopt;
  }
  const JsonNode lights = data.root()["extensions"][kExtension]["lights"];
  const std::optional<std::size_t> found = index.index("lights", lights.size());
  if (!found) {
    return std::nullopt;
  }
  const JsonNode light = lights.at(*found).tolerant();
  const auto color = light["color"].numbers<3>({1, 1, 1}, 0, 1);
  const double strength = light["intensity"].number(1, 0, 1e15) / kLumensPerWatt;
  const RgbColor power{static_cast<float>(color[0] * strength), static_cast<float>(color[1] * strength),
                       static_cast<float>(color[2] * strength)};
  if (light["range"].present()) {
    notices.left_out("ranges of lights: their light reaches everywhere");
  }
  Light out;
  out.name = name_of(placed, light);
  const std::string type = light["type"].text();
  if (type == "point") {
    out.kind = PointLight{placed.origin(), power};
  } else if (type == "directional") {
    out.kind = DirectionalLight{forward(placed), power};
  } else if (type == "spot") {
    const JsonNode spot = light["spot"];
    const double outer = spot["outerConeAngle"].number(std::numbers::pi / 4, 1e-6, std::numbers::pi / 2);
    const double inner = spot["innerConeAngle"].number(0, 0, std::numbers::pi / 2);
    if (inner > outer) {
      notices.left_out("inner cones of spot lights that are wider than the outer ones: their edges are sharp");
    }
    SpotLight kind;
    kind.position = placed.origin();
    kind.direction = forward(placed);
    kind.intensity = power;
    kind.cutoff_degrees = std::max(outer * 180 / std::numbers::pi, kMinCutoffDegrees);
    kind.blend = std::clamp(1 - inner / outer, 0.0, 1.0);
    out.kind = kind;
  } else {
    light["type"].fail(fmt::format("point, directional or spot is expected, got \"{}\"", type.substr(0, 40)));
    return std::nullopt;
  }
  return out;
}

std::optional<NamedCamera> read_camera(const GltfData& data, const PlacedNode& placed, Notices& notices) {
  const JsonNode index = placed.node["camera"];
  const JsonNode camera = data.element("cameras", index);
  if (!camera.present()) {
    return std::nullopt;
  }
  if (camera["type"].text() != "perspective") {
    notices.left_out("cameras that are not perspective");
    return std::nullopt;
  }
  NamedCamera out;
  out.name = name_of(placed, camera);
  const JsonNode view = camera["perspective"];
  const double fov = view["yfov"].number(0, 1e-4, std::numbers::pi - 1e-4);
  const JsonNode aspect = view["aspectRatio"];
  if (aspect.present()) {
    out.aspect = aspect.number(1, 1e-3, 1e3);
  }
  if (!view["yfov"].present()) {
    view["yfov"].fail("must be given");
    return std::nullopt;
  }
  const Point3d eye = placed.origin(), ahead = forward(placed), up = placed.axis(1);
  out.camera.eye = eye;
  // A step of the coordinates' size, because the axis may be tiny.
  const double step = std::max({1.0, std::abs(eye[0]), std::abs(eye[1]), std::abs(eye[2])}) / length(ahead);
  out.camera.look_at = {eye[0] + ahead[0] * step, eye[1] + ahead[1] * step, eye[2] + ahead[2] * step};
  out.camera.up = up;
  out.camera.vertical_fov_degrees = fov * 180 / std::numbers::pi;
  return out;
}

}  // namespace lightmill
