// Normals of smoothing groups.
#pragma once

#include <span>

#include "common/scene_io/obj.h"

namespace lightmill {

/// Shorter vectors have no reliable direction.
inline constexpr double kNoLength = 1e-290;

/// The unit normal of a triangle's plane; (0, 0, 1) if it has none.
std::array<float, 3> face_normal(const ObjFile& file, const ObjTriangle& triangle);

/// Whether a triangle has an area, so that it has a normal. It has none if corners coincide or lie on a line.
bool has_area(const ObjFile& file, const ObjTriangle& triangle);

/// Consecutive triangles of one part in one smoothing group.
struct SmoothRun {
  std::size_t part = 0;
  std::size_t begin = 0, end = 0;  ///< [begin, end) of the part's triangles
  std::int64_t group = 0;          ///< 0: none
};

/// Gives corners without a normal the mean of their group's face normals at their position, weighted by the faces'
/// angles there (Thürmer and Wüthrich 1998). The mean does not depend on the triangulation. If the normals cancel, the
/// corner gets none.
void smooth_normals(ObjFile& file, std::span<const SmoothRun> runs);

}  // namespace lightmill
