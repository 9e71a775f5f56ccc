// The coat of Mitsuba's rough plastic.
#pragma once

namespace lightmill {

/// Shares of uniform light at a rough dielectric surface. Light that meets several facets is lost, as in Mitsuba.
struct RoughCoat {
  double enters = 0;           ///< from outside
  double reflects = 0;         ///< from outside
  double reflects_inside = 0;  ///< from inside
};

/// Integrates over the facets (Walter et al. 2007, Eqs. 20 and 21), in about a millisecond. `ior`: of the inside over
/// the outside. `alpha` is above 0. Facets are distributed by Beckmann or GGX.
RoughCoat rough_coat(double ior, double alpha, bool beckmann);

}  // namespace lightmill
