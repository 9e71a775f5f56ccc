// A mesh that Draco has decoded, and the plain arrays that are made of it.
#pragma once

#include <functional>
#include <memory>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/decoder/compressed_mesh.h"

namespace draco {
class Mesh;
}

namespace lightmill {

/// Has the numbers of vertices and triangles, and the attributes, that were requested. Only the sandboxed child may make
/// one of bytes that are not ours.
class DracoMesh {
 public:
  /// INVALID_ARGUMENT if the bytes are damaged, or are another mesh than the requested one.
  static Result<DracoMesh> decode(ByteView bytes, const MeshRequest& request);
  DracoMesh(DracoMesh&&) noexcept;
  ~DracoMesh();

  std::uint64_t vertices() const;
  std::uint64_t triangles() const;
  /// The arrays of a DecodedMesh, one after another, in pieces. Indices are as they are in the mesh.
  Status write(const std::function<Status(ByteView)>& to) const;

 private:
  DracoMesh(std::unique_ptr<draco::Mesh> mesh, std::vector<CompressedAttribute> attributes);

  std::unique_ptr<draco::Mesh> mesh_;
  std::vector<CompressedAttribute> attributes_;
};

}  // namespace lightmill
