#include "common/image/decoder/compressed_mesh.h"

#include "common/base/number_text.h"

namespace lightmill {

Status check_request(const MeshRequest& request) {
  if (request.vertices > kMaxCompressedVertices || request.triangles > kMaxCompressedTriangles) {
    return resource_exhausted(
        "{} vertices and {} triangles are more than the {} and {} that a compressed mesh may have", request.vertices,
        request.triangles, kMaxCompressedVertices, kMaxCompressedTriangles);
  }
  if (request.attributes.size() > kMaxCompressedAttributes) {
    return resource_exhausted("{} attributes are more than the {} that a compressed mesh may have",
                              request.attributes.size(), kMaxCompressedAttributes);
  }
  for (const CompressedAttribute& attribute : request.attributes) {
    if (component_bytes(attribute.type) == 0 || attribute.components < 1 || attribute.components > 4) {
      return invalid_argument("{} components of type {} are not supported", attribute.components, attribute.type);
    }
  }
  return size_bytes(request) <= kMaxCompressedMeshBytes
             ? ok_status()
             : resource_exhausted("its arrays have more than the {} that a compressed mesh may have",
                                  human_bytes(kMaxCompressedMeshBytes));
}

std::uint64_t size_bytes(const MeshRequest& request) {
  std::uint64_t bytes = request.triangles * 3 * sizeof(std::uint32_t);
  for (const CompressedAttribute& attribute : request.attributes) {
    bytes += request.vertices * attribute.components * component_bytes(attribute.type);
  }
  return bytes;
}

}  // namespace lightmill
