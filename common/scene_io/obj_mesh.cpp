#include "common/scene_io/obj.h"

#include <algorithm>
#include <bit>

#include "common/scene_io/smoothing.h"

namespace lightmill {
namespace {

constexpr std::array<float, 3> kWhite{1, 1, 1};

/// The optional parts of a mesh.
struct Kinds {
  bool normals = false, texture = false;
};

/// Collects the vertices of a mesh, one for each combination at its corners, in the order of first use. It is a hash
/// table with open addressing, at most half full.
class VertexTable {
 public:
  VertexTable(const ObjFile& file, Kinds kinds, std::size_t triangles, Mesh& mesh)
      : file_(file), kinds_(kinds), mesh_(mesh), cells_(std::bit_ceil(6 * triangles + 1), kNoIndex) {
    const std::size_t likely = std::min(3 * triangles, file.positions.size());
    corners_.reserve(likely);
    mesh_.positions.reserve(likely);
  }

  std::uint32_t vertex(ObjCorner corner, const ObjTriangle& triangle) {
    corner.texture = kinds_.texture ? corner.texture : kNoIndex;
    corner.normal = kinds_.normals ? corner.normal : kNoIndex;
    if (kinds_.normals && corner.normal == kNoIndex) {
      return add(corner, face_normal(file_, triangle));
    }
    std::uint32_t& cell = find(corner);
    if (cell == kNoIndex) {
      cell = add(corner, kinds_.normals ? file_.normals[corner.normal] : std::array<float, 3>{});
    }
    return cell;
  }

 private:
  /// The cell with the vertex of this corner, or an empty cell for it.
  std::uint32_t& find(const ObjCorner& corner) {
    std::uint64_t hash = corner.position * 0x9e3779b97f4a7c15u;
    hash = (hash ^ (hash >> 32) ^ corner.normal) * 0xbf58476d1ce4e5b9u;
    hash = (hash ^ (hash >> 32) ^ corner.texture) * 0x94d049bb133111ebu;
    for (std::size_t at = hash ^ (hash >> 32);; ++at) {
      std::uint32_t& cell = cells_[at & (cells_.size() - 1)];
      if (cell == kNoIndex || corners_[cell] == corner) {
        return cell;
      }
    }
  }

  std::uint32_t add(const ObjCorner& corner, const std::array<float, 3>& normal) {
    corners_.push_back(corner);
    mesh_.positions.push_back(file_.positions[corner.position]);
    if (kinds_.normals) {
      mesh_.normals.push_back(normal);
    }
    if (!file_.colors.empty()) {
      const auto [r, g, b] = corner.position < file_.colors.size() ? file_.colors[corner.position] : kWhite;
      mesh_.colors.push_back({r, g, b, 1});
    }
    if (kinds_.texture) {
      mesh_.texture_coordinates.push_back(corner.texture == kNoIndex ? std::array<float, 2>{}
                                                                     : file_.texture_coordinates[corner.texture]);
    }
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  const ObjFile& file_;
  const Kinds kinds_;
  Mesh& mesh_;
  std::vector<ObjCorner> corners_;  ///< by vertex
  std::vector<std::uint32_t> cells_;
};

}  // namespace

Mesh make_mesh(const ObjFile& file, std::span<const ObjPart* const> parts) {
  Kinds kinds;
  std::size_t count = 0;
  for (const ObjPart* part : parts) {
    count += part->triangles.size();
    for (const ObjTriangle& triangle : part->triangles) {
      for (const ObjCorner& corner : triangle) {
        kinds.normals = kinds.normals || corner.normal != kNoIndex;
        kinds.texture = kinds.texture || corner.texture != kNoIndex;
      }
    }
  }
  Mesh mesh;
  mesh.triangles.reserve(count);
  VertexTable table(file, kinds, count, mesh);
  for (const ObjPart* part : parts) {
    for (const ObjTriangle& t : part->triangles) {
      const std::uint32_t a = table.vertex(t[0], t);
      const std::uint32_t b = table.vertex(t[1], t);
      const std::uint32_t c = table.vertex(t[2], t);
      mesh.triangles.push_back({a, b, c});
    }
  }
  return mesh;
}

}  // namespace lightmill
