#include "common/scene_io/gltf/gltf_mesh.h"

#include <cmath>

#include "common/scene/document.h"

namespace lightmill {
namespace {

enum Mode : std::uint64_t { kTriangles = 4, kStrip = 5, kFan = 6 };

/// The corners of each triangle, by vertex (glTF 2.0, 3.7.2.1).
std::vector<std::array<std::uint32_t, 3>> triangles_of(std::uint64_t mode, const std::vector<std::uint32_t>& v) {
  std::vector<std::array<std::uint32_t, 3>> out;
  if (mode == kTriangles) {
    out.reserve(v.size() / 3);
    for (std::size_t i = 0; i + 2 < v.size(); i += 3) {
      out.push_back({v[i], v[i + 1], v[i + 2]});
    }
    return out;
  }
  for (std::size_t i = 0; i + 2 < v.size(); ++i) {
    if (mode == kStrip) {
      out.push_back({v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]});
    } else {
      out.push_back({v[i + 1], v[i + 2], v[0]});
    }
  }
  return out;
}

/// The unit normal of a vertex whose own normal has no length: that of its first triangle with an area.
std::array<float, 3> normal_at(const Mesh& mesh, std::uint32_t vertex) {
  for (const auto& t : mesh.triangles) {
    if (t[0] != vertex && t[1] != vertex && t[2] != vertex) {
      continue;
    }
    const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const std::array<double, 3> u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, w{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const std::array<double, 3> n{u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]};
    const double length = std::hypot(n[0], n[1], n[2]);
    if (length > 1e-290) {
      return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)};
    }
  }
  return {0, 0, 1};
}

/// The vertices of a primitive: the accessors' elements that its triangles use. Primitives often share accessors and
/// use few of their elements each.
struct Vertices {
  std::size_t count = 0;            ///< of elements in each accessor
  std::vector<std::uint32_t> used;  ///< which of them, ascending
};

/// The vertices that the corners use, ascending. Replaces the corners by indices into this list.
std::vector<std::uint32_t> compact(std::vector<std::uint32_t>& corners) {
  std::vector<std::uint32_t> used;
  if (corners.empty()) {
    return used;
  }
  const auto [low, high] = std::ranges::minmax(corners);
  if ((high - low) / 16 > corners.size()) {  // a table would be large
    used = corners;
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (std::uint32_t& corner : corners) {
      corner = static_cast<std::uint32_t>(std::ranges::lower_bound(used, corner) - used.begin());
    }
    return used;
  }
  std::vector<std::uint32_t> place(std::size_t{high} - low + 1);
  for (const std::uint32_t corner : corners) {
    place[corner - low] = 1;
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] != 0) {
      place[i] = static_cast<std::uint32_t>(used.size());
      used.push_back(low + static_cast<std::uint32_t>(i));
    }
  }
  for (std::uint32_t& corner : corners) {
    corner = place[corner - low];
  }
  return used;
}

/// Whether an attribute has an element for each vertex. Reports an error if not.
bool fits(const GltfData& data, const JsonNode& attribute, std::string_view what, const Vertices& vertices) {
  const std::size_t count = data.count(attribute);
  if (data.status().ok() && count != vertices.count) {
    attribute.fail(fmt::format("{} {} are expected, got {}", vertices.count, what, count));
  }
  return data.status().ok();
}

void read_normals(const GltfData& data, const JsonNode& attribute, const Vertices& vertices, Mesh& mesh,
                  Notices& notices) {
  constexpr int kMaxReplaced = 1000;  // each takes a search
  const auto normals = fits(data, attribute, "normals", vertices) ? data.vectors<3>(attribute, vertices.used)
                                                                  : std::vector<std::array<double, 3>>();
  if (!data.status().ok()) {
    return;
  }
  int replaced = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const auto& [x, y, z] = normals[i];
    const double length = std::hypot(x, y, z);
    if (std::isfinite(length) && length > 1e-30) {
      mesh.normals.push_back(
          {static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length)});
    } else if (++replaced <= kMaxReplaced) {
      notices.once("normals without a direction were replaced by those of the faces");
      mesh.normals.push_back(normal_at(mesh, static_cast<std::uint32_t>(i)));
    } else {
      attribute.fail(fmt::format("more than {} normals have no direction", kMaxReplaced));
      return;
    }
  }
}

void read_texture_coordinates(const GltfData& data, const JsonNode& attribute, const Vertices& vertices, Mesh& mesh) {
  if (!fits(data, attribute, "texture coordinates", vertices)) {
    return;
  }
  for (const auto& [u, v] : data.vectors<2>(attribute, vertices.used)) {
    mesh.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(1 - v)});
  }
}

void say_attributes_left_out(const JsonNode& primitive, std::optional<std::uint64_t> texture_set, Notices& notices) {
  for (const std::string& name : primitive["attributes"].keys()) {
    if (name.starts_with("COLOR_")) {
      notices.left_out("vertex colours");
    } else if (name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")) {
      notices.left_out("skins (meshes keep their modelled pose)");
    } else if (name.starts_with("_")) {
      notices.left_out(fmt::format("vertex attribute {}", name));
    }
  }
  if (primitive["targets"].size() > 0) {
    notices.left_out("morph targets");
  }
  if (texture_set && !primitive["attributes"][fmt::format("TEXCOORD_{}", *texture_set)].present()) {
    notices.left_out("textures of meshes without texture coordinates: they show the colour at (0, 0)");
  }
}

}  // namespace

void Notices::once(std::string notice) {
  if (std::find(list_.begin(), list_.end(), notice) == list_.end()) {
    list_.push_back(std::move(notice));
  }
}

std::optional<Mesh> read_primitive(const GltfData& data, const JsonNode& primitive,
                                   std::optional<std::uint64_t> texture_set, Notices& notices) {
  const std::uint64_t mode = primitive["mode"].whole(kTriangles, 0, kFan);
  if (mode < kTriangles) {
    notices.left_out("points and lines");
    return std::nullopt;
  }
  const JsonNode attributes = primitive["attributes"];
  Mesh mesh;
  Vertices vertices;
  vertices.count = data.count(attributes["POSITION"]);
  std::vector<std::uint32_t> corners;
  if (primitive["indices"].present()) {
    corners = data.indices(primitive["indices"]);
    for (const std::uint32_t corner : corners) {
      if (corner >= vertices.count && data.status().ok()) {
        primitive["indices"].fail(fmt::format("vertex {} is out of range, there are {}", corner, vertices.count));
      }
    }
    if (!data.status().ok()) {
      return std::nullopt;
    }
    vertices.used = compact(corners);
    mesh.positions = data.vectors<3>(attributes["POSITION"], vertices.used);
  } else {
    mesh.positions = data.vectors<3>(attributes["POSITION"]);
    corners.resize(mesh.positions.size());
    std::iota(corners.begin(), corners.end(), 0u);
    vertices.used = corners;
  }
  if (!data.status().ok()) {
    return std::nullopt;
  }
  mesh.triangles = triangles_of(mode, corners);
  if (mesh.triangles.empty() || (mode == kTriangles && corners.size() % 3 != 0)) {
    primitive.fail(fmt::format("{} corners make no triangles", corners.size()));
    return std::nullopt;
  }
  if (attributes["NORMAL"].present()) {
    read_normals(data, attributes["NORMAL"], vertices, mesh, notices);
  }
  say_attributes_left_out(primitive, texture_set, notices);
  if (texture_set) {
    if (const JsonNode set = attributes[fmt::format("TEXCOORD_{}", *texture_set)]; set.present()) {
      read_texture_coordinates(data, set, vertices, mesh);
    }
  }
  if (!data.status().ok()) {
    return std::nullopt;
  }
  if (const Status valid = validate(mesh); !valid.ok()) {
    primitive.fail(message_of(valid));
    return std::nullopt;
  }
  return mesh;
}

}  // namespace lightmill
