// Loop's subdivision surfaces.
#pragma once

#include "common/scene/mesh.h"

namespace lightmill {

/// The limit surface of a triangle mesh (Loop 1987), at the vertices of `levels` subdivisions, with its normals. Each
/// level has four times as many triangles. Normals are on the side that sees the triangles clockwise, as in pbrt. The
/// mesh's own normals and texture coordinates are not used. INVALID_ARGUMENT unless the surface is a manifold, perhaps
/// with a boundary, whose triangles have the same direction.
Result<Mesh> loop_subdivision(const Mesh& base, int levels);

}  // namespace lightmill
