// Compressed primitives of GltfData (KHR_draco_mesh_compression).
#include "common/base/number_text.h"
#include "common/scene_io/gltf/gltf_data.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kTriangleMode = 4, kStripMode = 5;

/// Triangles for each vertex that a mesh without an accessor for its indices may have. A closed surface has two.
constexpr std::uint64_t kMaxTrianglesOfVertex = 4;

std::uint32_t components_of(const JsonNode& type) {
  constexpr std::array<std::string_view, 4> kNames{"SCALAR", "VEC2", "VEC3", "VEC4"};
  const std::string name = type.text();
  for (std::uint32_t i = 0; i < kNames.size(); ++i) {
    if (name == kNames[i]) {
      return i + 1;
    }
  }
  type.fail(fmt::format("SCALAR, VEC2, VEC3 or VEC4 is expected, got \"{}\"", name.substr(0, 40)));
  return 0;
}

std::string text_of(const MeshRequest& request) {
  std::string out = fmt::format("{} {} {}", request.vertices, request.triangles, request.fewer_triangles);
  for (const CompressedAttribute& attribute : request.attributes) {
    out += fmt::format(" {},{},{}", attribute.id, attribute.type, attribute.components);
  }
  return out;
}

}  // namespace

bool GltfData::has_data(const JsonNode& index) const {
  const JsonNode view = element("accessors", index)["bufferView"];
  return view.present() && (has_bytes(view) || element("bufferViews", view)["extensions"][kMeshopt].present());
}

bool GltfData::is_only_compressed(const JsonNode& primitive) const {
  const JsonNode attributes = primitive["attributes"], indices = primitive["indices"];
  if (!has_data(attributes["POSITION"]) || (indices.present() && !has_data(indices))) {
    return true;
  }
  for (const std::string& name : primitive["extensions"][kDraco]["attributes"].keys()) {
    if (attributes[name].present() && !has_data(attributes[name])) {
      return true;
    }
  }
  return false;
}

/// Adds the attributes that the extension has, but for those of applications. `names` are theirs.
MeshRequest GltfData::draco_request(const JsonNode& primitive, std::vector<std::string>& names) const {
  const JsonNode attributes = primitive["attributes"], indices = primitive["indices"];
  MeshRequest request;
  request.vertices = count(attributes["POSITION"]);
  const std::uint64_t mode = primitive["mode"].whole(kTriangleMode, 0, 6);
  if (mode != kTriangleMode && mode != kStripMode) {
    primitive["mode"].fail(fmt::format("compressed geometry must be triangles (4) or strips (5), got {}", mode));
  }
  if (!indices.present()) {
    request.triangles = kMaxTrianglesOfVertex * request.vertices;
    request.fewer_triangles = true;
  } else if (const std::uint64_t corners = count(indices); mode == kStripMode) {
    request.triangles = corners;
    request.fewer_triangles = true;
  } else {
    request.triangles = corners / 3;
    if (corners % 3 != 0) {
      element("accessors", indices)["count"].fail(fmt::format("{} corners make no whole number of triangles", corners));
    }
  }
  const JsonNode ids = primitive["extensions"][kDraco]["attributes"];
  for (const std::string& name : ids.keys()) {
    if (name.starts_with("_") || !attributes[name].present()) {
      continue;
    }
    const JsonNode accessor = element("accessors", attributes[name]);
    const std::uint64_t type = accessor["componentType"].whole(0, 5120, 5126);
    if (component_bytes(type) == 0) {
      accessor["componentType"].fail(fmt::format("5120, 5121, 5122, 5123, 5125 or 5126 is expected, got {}", type));
    }
    request.attributes.push_back({static_cast<std::uint32_t>(ids[name].whole(0, 0, 0xffffffffu)),
                                  static_cast<std::uint32_t>(type), components_of(accessor["type"])});
    names.push_back(name);
  }
  return request;
}

std::shared_ptr<const DecodedMesh> GltfData::decode_draco(const JsonNode& extension, const MeshRequest& request) const {
  const std::string key =
      fmt::format("{} {}", element("bufferViews", extension["bufferView"]).path(), text_of(request));
  const auto [found, added] = meshes_.try_emplace(key);
  if (!added) {
    return found->second;
  }
  const std::string_view bytes = view(extension["bufferView"]);
  if (!status().ok()) {
    return nullptr;
  }
  if (const Status allowed = check_request(request); !allowed.ok()) {
    extension.fail(allowed);
    return nullptr;
  }
  const std::uint64_t cost = size_bytes(request) + bytes.size();
  if (cost > draco_budget_) {
    extension.fail(
        resource_exhausted("the compressed meshes of the file have more than {}", human_bytes(kMaxDracoBytes)));
    return nullptr;
  }
  draco_budget_ -= cost;
  Result<DecodedMesh> mesh = decode_mesh_(as_byte_view(bytes), request);
  if (!mesh.ok()) {
    extension.fail(mesh.status());
    return nullptr;
  }
  found->second = std::make_shared<const DecodedMesh>(*std::move(mesh));
  return found->second;
}

std::shared_ptr<const DecodedMesh> GltfData::decompressed(const JsonNode& primitive) const {
  const auto [found, added] = decompressed_.try_emplace(primitive.path());
  const JsonNode extension = primitive["extensions"][kDraco];
  if (!added || !extension.present() || !is_only_compressed(primitive) || !status().ok()) {
    return found->second;
  }
  if (decode_mesh_ == nullptr) {
    primitive.fail(fmt::format(
        "its geometry is compressed ({}), and there is none beside it: export it without compression", kDraco));
    return nullptr;
  }
  std::vector<std::string> names;
  const MeshRequest request = draco_request(primitive, names);
  if (!status().ok()) {
    return nullptr;
  }
  found->second = decode_draco(extension, request);
  for (std::size_t i = 0; found->second != nullptr && i < names.size(); ++i) {
    attributes_.emplace(primitive["attributes"][names[i]].path(), found->second->attributes[i]);
  }
  return found->second;
}

}  // namespace lightmill
