// Compressed mesh (Draco): the request to its decoder, and the decoded arrays.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// Limits of one compressed mesh.
inline constexpr std::uint64_t kMaxCompressedVertices = std::uint64_t{1} << 25;
inline constexpr std::uint64_t kMaxCompressedTriangles = std::uint64_t{1} << 25;
inline constexpr std::size_t kMaxCompressedAttributes = 32;
inline constexpr std::uint64_t kMaxCompressedMeshBytes = std::uint64_t{4} << 30;  ///< of its arrays

/// The number of bytes of a component, by glTF's code of its type (5126: float). 0 for other codes.
inline std::uint32_t component_bytes(std::uint64_t type) {
  switch (type) {
    case 5120:  // int8
    case 5121:  // uint8
      return 1;
    case 5122:  // int16
    case 5123:  // uint16
      return 2;
    case 5125:  // uint32
    case 5126:  // float
      return 4;
    default:
      return 0;
  }
}

/// An attribute of each vertex.
struct CompressedAttribute {
  std::uint32_t id = 0;    ///< Draco's unique id
  std::uint32_t type = 0;  ///< wanted component type, as glTF's code
  std::uint32_t components = 0;

  bool operator==(const CompressedAttribute&) const = default;
};

struct MeshRequest {
  std::uint64_t vertices = 0;  ///< the mesh must have exactly this many
  std::uint64_t triangles = 0;
  bool fewer_triangles = false;  ///< the mesh may have fewer triangles than `triangles`
  std::vector<CompressedAttribute> attributes;
};

struct DecodedMesh {
  std::vector<std::uint32_t> corners;   ///< three of each triangle, each below the number of vertices
  std::vector<std::string> attributes;  ///< the requested ones: numbers in memory order, without gaps
};

/// Checks a request against the limits. RESOURCE_EXHAUSTED if it asks for more.
Status check_request(const MeshRequest& request);
/// The size of all arrays that are asked for, at most.
std::uint64_t size_bytes(const MeshRequest& request);

/// Decodes the bytes of a compressed mesh. The arrays are as requested, or there is an error. Errors do not name the
/// mesh.
using MeshDecoder = std::function<Result<DecodedMesh>(ByteView bytes, const MeshRequest& request)>;

}  // namespace lightmill
