// Which triangles of a mesh hang together, and which way round.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace lightmill {

/// Triangles hang together where two of them, and no third, share an edge; corners in one place are one. What has no
/// two distinct edges, or is there already, belongs to a part but changes nothing.
struct MeshParts {
  std::vector<std::uint32_t> of_triangle;  ///< the number of its part
  std::vector<bool> flipped;               ///< of each triangle: wound against the first one of its part
  std::vector<bool> closed;                ///< of each part: no edge is free, and it has two sides
};

MeshParts find_parts(const std::vector<std::array<float, 3>>& positions,
                     const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace lightmill
