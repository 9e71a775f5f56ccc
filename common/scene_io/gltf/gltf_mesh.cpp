#include "common/scene_io/gltf/gltf_mesh.h"

#include <cmath>
#include <numeric>

#include "common/base/number_text.h"
#include "common/math/vec.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/document.h"

namespace lightmill {
namespace {

enum Mode : std::uint64_t { kTriangles = 4, kStrip = 5, kFan = 6 };
constexpr std::array<float, 3> kNoNormal{0, 0, 0};

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

/// Twice the area of a triangle, along its normal.
Vec3d area_vector(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vec3d a = to_vec(mesh.positions[t[0]]);
  return glm::cross(to_vec(mesh.positions[t[1]]) - a, to_vec(mesh.positions[t[2]]) - a);
}

bool has_area(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return glm::length(area_vector(mesh, t)) > 0;
}

/// Gives vertices whose normal is (0, 0, 0) that of their first triangle with an area, else (0, 0, 1).
void replace_missing_normals(Mesh& mesh) {
  for (const auto& t : mesh.triangles) {
    const Vec3d n = area_vector(mesh, t);
    const double length = std::hypot(n.x, n.y, n.z);
    for (const std::uint32_t corner : t) {
      if (length > 1e-290 && mesh.normals[corner] == kNoNormal) {
        mesh.normals[corner] = {static_cast<float>(n.x / length), static_cast<float>(n.y / length),
                                static_cast<float>(n.z / length)};
      }
    }
  }
  std::ranges::replace(mesh.normals, kNoNormal, std::array<float, 3>{0, 0, 1});
}

/// The vertices that the triangles use, ascending. Replaces their corners by indices into this list.
std::vector<std::uint32_t> compact(std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::uint32_t> used;
  if (triangles.empty()) {
    return used;
  }
  std::uint32_t low = triangles[0][0], high = low;
  for (const auto& t : triangles) {
    low = std::min({low, t[0], t[1], t[2]});
    high = std::max({high, t[0], t[1], t[2]});
  }
  if ((high - low) / 48 > triangles.size()) {  // a table would be large
    for (const auto& t : triangles) {
      used.insert(used.end(), t.begin(), t.end());
    }
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (auto& t : triangles) {
      for (std::uint32_t& corner : t) {
        corner = static_cast<std::uint32_t>(std::ranges::lower_bound(used, corner) - used.begin());
      }
    }
    return used;
  }
  std::vector<std::uint32_t> place(std::size_t{high} - low + 1);
  for (const auto& t : triangles) {
    for (const std::uint32_t corner : t) {
      place[corner - low] = 1;
    }
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] != 0) {
      place[i] = static_cast<std::uint32_t>(used.size());
      used.push_back(low + static_cast<std::uint32_t>(i));
    }
  }
  for (auto& t : triangles) {
    for (std::uint32_t& corner : t) {
      corner = place[corner - low];
    }
  }
  return used;
}

void read_normals(const GltfData& data, const JsonNode& primitive, const MeshPose& pose, const GltfVertices& vertices,
                  Mesh& mesh) {
  const JsonNode attribute = primitive["attributes"]["NORMAL"];
  auto normals = has_all(data, attribute, "normals", vertices) ? data.vectors<3>(attribute, vertices.used)
                                                               : std::vector<std::array<double, 3>>();
  add_morph_targets(data, primitive, "NORMAL", pose, vertices, normals);
  std::size_t missing = 0;
  for (const auto& [x, y, z] : normals) {
    const double length = std::hypot(x, y, z);
    if (std::isfinite(length) && length > 1e-30) {
      mesh.normals.push_back(
          {static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length)});
    } else {
      mesh.normals.push_back(kNoNormal);
      ++missing;
    }
  }
  if (missing > 0) {
    attribute.fault(fmt::format("{} without a direction", counted(missing, "normal")),
                    "the normals of the faces are used");
    replace_missing_normals(mesh);
  }
}

void read_texture_coordinates(const GltfData& data, const JsonNode& attribute, const GltfVertices& vertices,
                              Mesh& mesh) {
  if (!has_all(data, attribute, "texture coordinates", vertices)) {
    return;
  }
  for (const auto& [u, v] : data.vectors<2>(attribute, vertices.used)) {
    mesh.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(1 - v)});
  }
}

/// Linear colours with or without alpha (glTF 2.0, 3.7.2.1).
void read_colors(const GltfData& data, const JsonNode& attribute, const GltfVertices& vertices, Mesh& mesh) {
  if (!has_all(data, attribute, "colours", vertices)) {
    return;
  }
  bool cut = false;
  const auto part = [&](double value) {
    cut = cut || !(value >= 0 && value <= 1.001);  // some are slightly above 1
    return value > 0 ? static_cast<float>(std::min(value, 1.0)) : 0.0f;
  };
  if (data.element("accessors", attribute)["type"].text() == "VEC3") {
    for (const auto& [r, g, b] : data.vectors<3>(attribute, vertices.used)) {
      mesh.colors.push_back({part(r), part(g), part(b), 1});
    }
  } else {
    for (const auto& [r, g, b, a] : data.vectors<4>(attribute, vertices.used)) {
      mesh.colors.push_back({part(r), part(g), part(b), part(a)});
    }
  }
  if (cut) {
    attribute.fault("colours from 0 to 1 are expected", "other values are cut");
  }
}

void read_tangents(const GltfData& data, const JsonNode& primitive, const MeshPose& pose, const GltfVertices& vertices,
                   Mesh& mesh) {
  const JsonNode attribute = primitive["attributes"]["TANGENT"];
  if (!has_all(data, attribute, "tangents", vertices)) {
    return;
  }
  const auto tangents = data.vectors<4>(attribute, vertices.used);
  std::vector<std::array<double, 3>> directions;
  for (const auto& [x, y, z, sign] : tangents) {
    directions.push_back({x, y, z});
  }
  add_morph_targets(data, primitive, "TANGENT", pose, vertices, directions);
  std::size_t missing = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto& [x, y, z] = directions[i];
    const double length = std::hypot(x, y, z);
    missing += std::isfinite(length) && length > 1e-30 ? 0 : 1;
    mesh.tangents.push_back({static_cast<float>(x / length), static_cast<float>(y / length),
                             static_cast<float>(z / length), tangents[i][3] < 0 ? -1.0f : 1.0f});
  }
  if (missing > 0) {
    attribute.fault(fmt::format("{} without a direction", counted(missing, "tangent")),
                    "the tangents of the texture coordinates are used");
    mesh.tangents.clear();
  }
}

void say_attributes_left_out(const JsonNode& primitive, std::optional<std::uint64_t> texture_set, Notices& notices) {
  for (const std::string& name : primitive["attributes"].keys()) {
    if (name.starts_with("COLOR_") && name != "COLOR_0") {
      notices.left_out("vertex colours beyond the first ones");
    } else if (name.starts_with("_")) {
      notices.left_out(fmt::format("vertex attribute {}", name));
    }
  }
  const JsonNode targets = primitive["targets"];
  for (std::size_t i = 0; i < targets.size(); ++i) {
    for (const std::string& name : targets.at(i).keys()) {
      if (name != "POSITION" && name != "NORMAL" && name != "TANGENT") {
        notices.left_out("morph targets of other attributes than positions, normals and tangents");
      }
    }
  }
  if (texture_set && !primitive["attributes"][fmt::format("TEXCOORD_{}", *texture_set)].present()) {
    notices.left_out("textures of meshes without texture coordinates: they show the colour at (0, 0)");
  }
}

/// Whether the positions are not in the file, or only in a compressed form. Then it reports an error.
bool is_lost(const GltfData& data, const JsonNode& primitive) {
  const JsonNode position = primitive["attributes"]["POSITION"];
  const JsonNode accessor = data.element("accessors", position);
  const JsonNode view = data.element("bufferViews", accessor["bufferView"]);
  if (data.is_decompressed(position)) {
    return !data.status().ok();
  }
  if (constexpr const char* kOther = "KHR_meshopt_compression";
      view["extensions"][kOther].present() && !data.has_bytes(accessor["bufferView"])) {
    primitive.fail(fmt::format(
        "its geometry is compressed ({}), and there is none beside it: export it without compression", kOther));
    return true;
  }
  if (accessor.present() && !accessor["bufferView"].present() && !accessor["sparse"].present()) {
    primitive.fail(fmt::format("its positions are not in the file: {} has no bufferView", accessor.path()));
  }
  return !data.status().ok();
}

/// Leaves out triangles with a vertex that does not exist.
void leave_out_wrong_triangles(const JsonNode& indices, std::size_t vertices, Mesh& mesh) {
  const auto is_wrong = [&](std::uint32_t corner) { return corner >= vertices; };
  const auto wrong = [&](const auto& t) { return std::ranges::any_of(t, is_wrong); };
  const auto first = std::ranges::find_if(mesh.triangles, wrong);
  if (first == mesh.triangles.end()) {
    return;
  }
  const std::string what =
      fmt::format("vertex {} is out of range, there are {}", *std::ranges::find_if(*first, is_wrong), vertices);
  const std::size_t left_out = std::erase_if(mesh.triangles, wrong);
  if (mesh.triangles.empty()) {
    indices.fail(what);
  } else {
    indices.fault(what, left_out == 1 ? "the triangle is skipped"
                                      : fmt::format("the {} triangles with such vertices are skipped", left_out));
  }
}

}  // namespace

std::optional<Mesh> read_primitive(const GltfData& data, const JsonNode& primitive, const MeshPose& pose,
                                   std::optional<std::uint64_t> texture_set, bool tangents, std::uint64_t& deformed,
                                   Notices& notices) {
  std::uint64_t mode = primitive["mode"].whole(kTriangles, 0, kFan);
  if (mode < kTriangles) {
    notices.left_out("points and lines");
    return std::nullopt;
  }
  const JsonNode attributes = primitive["attributes"];
  const std::shared_ptr<const DecodedMesh> decompressed = data.decompressed(primitive);
  if (is_lost(data, primitive)) {
    return std::nullopt;
  }
  Mesh mesh;
  GltfVertices vertices;
  vertices.count = data.count(attributes["POSITION"]);
  std::vector<std::uint32_t> corners;
  if (decompressed != nullptr) {
    corners = decompressed->corners;
    mode = kTriangles;
  } else if (primitive["indices"].present()) {
    corners = data.indices(primitive["indices"]);
  } else {
    mesh.positions = data.vectors<3>(attributes["POSITION"]);
    corners.resize(mesh.positions.size());
    std::iota(corners.begin(), corners.end(), 0u);
  }
  if (!data.status().ok()) {
    return std::nullopt;
  }
  mesh.triangles = triangles_of(mode, corners);
  if (mesh.triangles.empty()) {
    primitive.fail(fmt::format("{} corners make no triangles", corners.size()));
    return std::nullopt;
  }
  if (mode == kTriangles && corners.size() % 3 != 0) {
    primitive.fault(fmt::format("{} corners make no whole number of triangles", corners.size()),
                    "the last ones are skipped");
  }
  leave_out_wrong_triangles(primitive["indices"], vertices.count, mesh);
  vertices.used = compact(mesh.triangles);
  if (pose.deforms() && !count_deformed(primitive, pose, vertices.used.size(), mesh.triangles.size(), deformed)) {
    return std::nullopt;
  }
  if (vertices.used.size() != mesh.positions.size()) {
    mesh.positions = data.vectors<3>(attributes["POSITION"], vertices.used);
  }
  add_morph_targets(data, primitive, "POSITION", pose, vertices, mesh.positions);
  if (attributes["NORMAL"].present()) {
    read_normals(data, primitive, pose, vertices, mesh);
  }
  say_attributes_left_out(primitive, texture_set, notices);
  if (texture_set) {
    if (const JsonNode set = attributes[fmt::format("TEXCOORD_{}", *texture_set)]; set.present()) {
      read_texture_coordinates(data, set, vertices, mesh);
    }
  }
  if (const JsonNode colors = attributes["COLOR_0"]; colors.present()) {
    read_colors(data, colors, vertices, mesh);
  }
  if (tangents && attributes["TANGENT"].present()) {
    read_tangents(data, primitive, pose, vertices, mesh);
  }
  if (pose.joints != nullptr && data.status().ok()) {
    move_with_joints(data, primitive, pose, vertices, mesh);
  }
  if (data.status().ok() && std::ranges::none_of(mesh.triangles, [&](const auto& t) { return has_area(mesh, t); })) {
    if (pose.deforms()) {
      primitive.fault("none of its triangles has an area in this pose", "it is left out");
      return std::nullopt;
    }
    primitive.fail("none of its triangles has an area");
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
