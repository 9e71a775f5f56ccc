// The light of emissive facets on a surface if nothing else is in the way, by formulas.
#pragma once

#include <vector>

#include "common/lights/facet_light.h"

namespace lightmill {

/// Immutable once built, thread-safe. The facets' exponents must be 0.
///
/// A surface does not hide what is behind it here, so of what emits on both sides the facets in front and those behind
/// them would both count. Therefore each part that hangs together counts by one of its sides: the one that gives more
/// where the surface is. For a convex closed part this is what is seen of it, from outside and from within, and so for
/// one with a hole; what shows one side here and the other there, such as a tube that is open at both ends, gives up to
/// half of it.
class FacetIrradiance {
 public:
  FacetIrradiance() = default;
  explicit FacetIrradiance(const FacetLights& facets);

  /// On surfaces at p with unit normals n, in W/m²: Lambert's formula for what of a facet is above the surface; those
  /// that are small and far as points, which is right to 1e-3. Takes time in proportion to the number of facets.
  V8 at(const V8& p, const V8& n, M8 lanes) const;

 private:
  std::vector<EmissiveFacet> facets_;  ///< those of a part in a row
};

}  // namespace lightmill
