// Coats of plastic whose light between the facets is lost.
#pragma once

namespace lightmill {

enum class CoatFacets {
  beckmann,        ///< those of Beckmann, seen and lit independently
  ggx,             ///< GGX, seen and lit independently
  ggx_correlated,  ///< GGX, whose heights decide which ones are both seen and lit
};

/// Shares of uniform light at a dielectric surface. Light that meets several facets is lost.
struct RoughCoat {
  double enters = 0;           ///< from outside
  double reflects = 0;         ///< from outside
  double reflects_inside = 0;  ///< from inside
};

/// Integrates over the facets (Walter et al. 2007, Eqs. 20 and 21), in about a millisecond. `ior`: of the inside over
/// the outside. `alpha` is 0 for smooth surfaces. The inside absorbs: the light that enters has crossed a layer of the optical depth `depth`, and that which is
/// reflected inside has crossed it twice.
RoughCoat rough_coat(double ior, double alpha, CoatFacets facets, double depth = 0);

}  // namespace lightmill
