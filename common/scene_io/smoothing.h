// Normals that a file leaves to its smoothing groups.
#pragma once

#include <span>

#include "common/scene_io/obj.h"

namespace lightmill {

/// Vectors shorter than this have lost their direction to rounding.
inline constexpr double kNoLength = 1e-290;

/// The unit normal of a triangle's plane; (0, 0, 1) if it has none.
std::array<float, 3> face_normal(const ObjFile& file, const ObjTriangle& triangle);

/// Triangles of one part that follow each other in one smoothing group.
struct SmoothRun {
  std::size_t part = 0;
  std::size_t begin = 0, end = 0;  ///< [begin, end) of the part's triangles
  std::int64_t group = 0;          ///< 0: none
};

/// Gives the corners of these triangles that have no normal the mean of the face normals that their group has at their
/// position, weighted by the faces' angles there (Thürmer and Wüthrich 1998: it does not depend on how polygons were
/// cut). Where they cancel there is none.
void smooth_normals(ObjFile& file, std::span<const SmoothRun> runs);

}  // namespace lightmill
