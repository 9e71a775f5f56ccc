#include "decoder/draco_mesh.h"

#include <draco/compression/decode.h>

namespace lightmill {
namespace {

constexpr std::uint64_t kPiece = 65536;  ///< triangles or vertices that are written at once

ByteView bytes_of(const auto& numbers) {
  return std::as_bytes(std::span(numbers));
}

/// Whether every vertex has a value in the attribute's buffer.
bool is_sound(const draco::PointAttribute& attribute, std::uint64_t vertices) {
  if (attribute.buffer() == nullptr || attribute.byte_stride() <= 0) {
    return false;
  }
  const std::uint64_t needed = static_cast<std::uint64_t>(attribute.byte_stride()) * attribute.size() +
                               static_cast<std::uint64_t>(attribute.byte_offset());
  return needed <= attribute.buffer()->data_size() &&
         (attribute.is_mapping_identity() ? attribute.size() : attribute.indices_map_size()) >= vertices;
}

/// Writes the attribute's values as numbers of type T.
template <class T>
Status write_as(const draco::PointAttribute& from, std::uint64_t vertices, const CompressedAttribute& wanted,
                const std::function<Status(ByteView)>& to) {
  std::vector<T> piece;
  for (std::uint64_t first = 0; first < vertices; first += kPiece) {
    const std::uint64_t end = std::min(first + kPiece, vertices);
    piece.resize((end - first) * wanted.components);
    T* out = piece.data();
    for (std::uint64_t vertex = first; vertex < end; ++vertex, out += wanted.components) {
      const draco::AttributeValueIndex value = from.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(vertex)));
      if (value.value() >= from.size()) {
        return invalid_argument("vertex {} has no value of attribute {}", vertex, wanted.id);
      }
      if (!from.ConvertValue<T>(value, static_cast<std::int8_t>(wanted.components), out)) {
        return invalid_argument("attribute {} has a value that its type {} cannot have", wanted.id, wanted.type);
      }
    }
    LM_RETURN_IF_ERROR(to(bytes_of(piece)));
  }
  return ok_status();
}

Status write_attribute(const draco::PointAttribute& from, std::uint64_t vertices, const CompressedAttribute& wanted,
                       const std::function<Status(ByteView)>& to) {
  switch (wanted.type) {
    case 5120:
      return write_as<std::int8_t>(from, vertices, wanted, to);
    case 5121:
      return write_as<std::uint8_t>(from, vertices, wanted, to);
    case 5122:
      return write_as<std::int16_t>(from, vertices, wanted, to);
    case 5123:
      return write_as<std::uint16_t>(from, vertices, wanted, to);
    case 5125:
      return write_as<std::uint32_t>(from, vertices, wanted, to);
    default:
      return write_as<float>(from, vertices, wanted, to);
  }
}

Status check_counts(const draco::Mesh& mesh, const MeshRequest& request) {
  if (mesh.num_points() != request.vertices) {
    return invalid_argument("the compressed data have {} vertices, but {} are expected", mesh.num_points(),
                            request.vertices);
  }
  if (request.fewer_triangles ? mesh.num_faces() > request.triangles : mesh.num_faces() != request.triangles) {
    return invalid_argument("the compressed data have {} triangles, but {}{} are expected", mesh.num_faces(),
                            request.fewer_triangles ? "at most " : "", request.triangles);
  }
  return ok_status();
}

Status check_attributes(const draco::Mesh& mesh, const MeshRequest& request) {
  for (const CompressedAttribute& wanted : request.attributes) {
    const draco::PointAttribute* const attribute = mesh.GetAttributeByUniqueId(wanted.id);
    if (attribute == nullptr) {
      return invalid_argument("the compressed data have no attribute {}", wanted.id);
    }
    if (attribute->num_components() != wanted.components) {
      return invalid_argument("attribute {} of the compressed data has {} components, but {} are expected", wanted.id,
                              attribute->num_components(), wanted.components);
    }
    const bool floats = attribute->data_type() == draco::DT_FLOAT32 || attribute->data_type() == draco::DT_FLOAT64;
    if (floats && wanted.type != 5126) {
      return invalid_argument("attribute {} of the compressed data has floats, but type {} is expected", wanted.id,
                              wanted.type);
    }
    if (!is_sound(*attribute, request.vertices)) {
      return invalid_argument("the compressed data are damaged: attribute {} is incomplete", wanted.id);
    }
  }
  return ok_status();
}

}  // namespace

DracoMesh::DracoMesh(std::unique_ptr<draco::Mesh> mesh, std::vector<CompressedAttribute> attributes)
    : mesh_(std::move(mesh)), attributes_(std::move(attributes)) {}
DracoMesh::DracoMesh(DracoMesh&&) noexcept = default;
DracoMesh::~DracoMesh() = default;

Result<DracoMesh> DracoMesh::decode(ByteView bytes, const MeshRequest& request) {
  LM_RETURN_IF_ERROR(check_request(request));
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::StatusOr<std::unique_ptr<draco::Mesh>> decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) {
    std::string why = decoded.status().error_msg_string();
    while (why.ends_with('.')) {
      why.pop_back();
    }
    return invalid_argument("the compressed data are damaged{}{}: export the mesh again", why.empty() ? "" : ": ", why);
  }
  std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  LM_RETURN_IF_ERROR(check_counts(*mesh, request));
  LM_RETURN_IF_ERROR(check_attributes(*mesh, request));
  return DracoMesh(std::move(mesh), request.attributes);
}

std::uint64_t DracoMesh::vertices() const {
  return mesh_->num_points();
}

std::uint64_t DracoMesh::triangles() const {
  return mesh_->num_faces();
}

Status DracoMesh::write(const std::function<Status(ByteView)>& to) const {
  std::vector<std::uint32_t> corners;
  for (std::uint64_t first = 0; first < triangles(); first += kPiece) {
    corners.clear();
    for (std::uint64_t i = first; i < std::min(first + kPiece, triangles()); ++i) {
      for (const draco::PointIndex& corner : mesh_->face(draco::FaceIndex(static_cast<std::uint32_t>(i)))) {
        corners.push_back(corner.value());
      }
    }
    LM_RETURN_IF_ERROR(to(bytes_of(corners)));
  }
  for (const CompressedAttribute& wanted : attributes_) {
    LM_RETURN_IF_ERROR(write_attribute(*mesh_->GetAttributeByUniqueId(wanted.id), vertices(), wanted, to));
  }
  return ok_status();
}

}  // namespace lightmill
