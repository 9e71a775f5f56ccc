// How a texture lies on an emissive facet of a mesh.
#pragma once

#include "common/lights/facet_light.h"
#include "common/scene/document.h"
#include "common/scene/mesh.h"

namespace lightmill {

/// On a facet whose corner, and ends of both edges, are these corners of the mesh.
FacetTexture facet_texture(const Material& material, const Mesh& mesh, const std::array<std::uint32_t, 3>& corners);

/// Whether this corner of the mesh has the coordinates of a parallelogram's corner at the end of both edges.
bool fits_parallelogram(const FacetTexture& texture, const Mesh& mesh, std::uint32_t corner);

}  // namespace lightmill
