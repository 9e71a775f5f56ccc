// The connected parts of a mesh, and the orientation of their triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace lightmill {

/// Two triangles are connected if they, and no third, share an edge. Corners in one place count as one. Triangles
/// without two distinct edges, and repeated triangles, belong to a part but change nothing.
struct MeshParts {
  std::vector<std::uint32_t> of_triangle;  ///< number of its part
  std::vector<bool> flipped;               ///< of each triangle: opposite orientation to the first one of its part
  std::vector<bool> closed;                ///< of each part: no free edge, and it has two sides
};

MeshParts find_parts(const std::vector<std::array<float, 3>>& positions,
                     const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace lightmill
