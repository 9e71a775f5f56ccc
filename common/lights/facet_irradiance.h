// Irradiance from emissive facets without occlusion, in closed form.
#pragma once

#include <vector>

#include "common/lights/facet_light.h"

namespace lightmill {

/// Immutable once built, thread-safe. The facets' exponents must be 0.
///
/// Nothing is occluded here, so both the front and the back of a two-sided shape would count. Therefore each connected
/// part counts with one of its sides, the one that gives more irradiance at the surface. For a convex closed part, also
/// with a hole, this is its visible light, from outside and from inside. A part with two visible sides, such as an open
/// tube, gives as little as half of its light.
class FacetIrradiance {
 public:
  FacetIrradiance() = default;
  explicit FacetIrradiance(const FacetLights& facets);

  /// On surfaces at p with unit normals n, in W/m². Uses Lambert's formula for the part of a facet above the surface.
  /// Small and distant facets count as points, which is accurate to 1e-3. Takes time proportional to the number of
  /// facets.
  V8 at(const V8& p, const V8& n, M8 lanes) const;

 private:
  std::vector<EmissiveFacet> facets_;  ///< facets of a part are consecutive
};

}  // namespace lightmill
