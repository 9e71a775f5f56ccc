// Changes of meshes that scene files ask for.
#pragma once

#include "common/scene/mesh.h"

namespace lightmill {

/// Turns the mesh's sides.
void reverse_orientation(Mesh& mesh);

/// Turns triangles whose geometric normal opposes their shading normals. The mesh must have shading normals.
void follow_normals(Mesh& mesh);

/// Gives each vertex the mean of its triangles' normals, weighted by their angles there (Thürmer and Wüthrich 1998).
/// The mesh stays flat if it has a vertex whose normals cancel.
void add_normals(Mesh& mesh);

/// Gives each vertex the mean direction of u. That of v is normal × direction.
void add_tangents(Mesh& mesh);

/// Gives each triangle its own vertices with these texture coordinates.
void set_triangle_coordinates(Mesh& mesh, const std::array<std::array<float, 2>, 3>& coordinates);

}  // namespace lightmill
