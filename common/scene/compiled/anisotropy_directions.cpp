#include "common/scene/compiled/anisotropy_directions.h"

#include <limits>

#include "common/math/transcendental.h"

namespace lightmill {

AnisotropyDirections::AnisotropyDirections(const MaterialRows& rows) {
  for (const auto& material : rows.materials) {
    const Anisotropy* anisotropy = anisotropy_of(*material);
    const double angle = anisotropy != nullptr ? anisotropy->rotation_degrees * kPiDouble / 180 : 0;
    cosine_.push_back(static_cast<float>(cos_fixed(angle)));
    sine_.push_back(static_cast<float>(sin_fixed(angle)));
  }
}

void AnisotropyDirections::find(const GeometryTable& geometry, const Hit8& hits, Surface8& surface) const {
  const M8 lanes = surface.directed;
  Tangents8 tangents = geometry.derivatives(hits, surface, lanes);
  geometry.use_vertex_tangents(hits, surface, lanes, tangents);
  const V8& n = surface.shading_normal;
  const V8 along = tangents.u - n * dot(n, tangents.u);
  const F8 length2 = length_squared(along);
  const V8 t = along * (F8(1.0f) / sqrt(length2));
  const V8 across = cross(n, t);
  const V8 b = across * copysign(F8(1.0f), dot(across, tangents.v));
  surface.tangent = t * cosine_.at(surface.material, lanes) + b * sine_.at(surface.material, lanes);
  surface.directed = lanes & (length2 > F8(0.0f)) & (length2 < F8(std::numeric_limits<float>::infinity()));
}

}  // namespace lightmill
