#include "common/scene/compiled/facet_texture.h"

#include <cmath>

namespace lightmill {

FacetTexture facet_texture(const Material& material, const Mesh& mesh, const std::array<std::uint32_t, 3>& corners) {
  FacetTexture out{material.emission.texture};
  if (out.number != kNoTexture && !mesh.texture_coordinates.empty()) {
    const auto& all = mesh.texture_coordinates;
    out.corner = all[corners[0]];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      out.edge1[axis] = all[corners[1]][axis] - out.corner[axis];
      out.edge2[axis] = all[corners[2]][axis] - out.corner[axis];
    }
  }
  return out;
}

bool fits_parallelogram(const FacetTexture& texture, const Mesh& mesh, std::uint32_t corner) {
  if (texture.number == kNoTexture || mesh.texture_coordinates.empty()) {
    return true;
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const float a = texture.edge1[axis], b = texture.edge2[axis];
    const float off = texture.corner[axis] + a + b - mesh.texture_coordinates[corner][axis];
    if (std::abs(off) > 1e-6f * (std::abs(texture.corner[axis]) + std::abs(a) + std::abs(b))) {
      return false;
    }
  }
  return true;
}

}  // namespace lightmill
