#include "common/scene_io/gltf/gltf_lights.h"

#include <cmath>
#include <numbers>

namespace lightmill {
namespace {

constexpr double kLumensPerWatt = 683;

std::string name_of(const PlacedNode& placed, const JsonNode& thing) {
  const std::string node = placed.node["name"].text();
  return !node.empty() ? node : thing["name"].text();
}

/// The node's −z axis, along which its lights and cameras look. It must not be zero.
Point3d forward(const PlacedNode& placed) {
  const Point3d axis = placed.axis(2, -1);
  if (!(std::hypot(axis[0], axis[1], axis[2]) > 1e-30)) {
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
    kind.cutoff_degrees = std::max(outer * 180 / std::numbers::pi, kLeastCutoffDegrees);
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
  const double length = std::hypot(ahead[0], ahead[1], ahead[2]);
  const double step = std::max({1.0, std::abs(eye[0]), std::abs(eye[1]), std::abs(eye[2])}) / length;
  out.camera.look_at = {eye[0] + ahead[0] * step, eye[1] + ahead[1] * step, eye[2] + ahead[2] * step};
  out.camera.up = up;
  out.camera.vertical_fov_degrees = fov * 180 / std::numbers::pi;
  return out;
}

}  // namespace lightmill
