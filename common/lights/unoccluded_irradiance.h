// The light that a surface would get if nothing were in its way, without noise: what holdouts compare theirs with.
#pragma once

#include <vector>

#include "common/lights/facet_irradiance.h"
#include "common/lights/light_table.h"

namespace lightmill {

/// Immutable once built, thread-safe. Lights and emissive surfaces that are not in the table do not count; those with
/// an emission exponent must not be there.
class UnoccludedIrradiance {
 public:
  UnoccludedIrradiance() = default;
  explicit UnoccludedIrradiance(const LightTable& lights);

  /// On surfaces at `p` with unit normals `n`, in W/m². `lights` are those that it was built from. That of an
  /// environment's image is right within some thousandths; of a small sun in it, on normals within 2° of
  /// where it sets, within some hundredths of what it gives at most.
  V8 at(const LightTable& lights, const V8& p, const V8& n, M8 lanes) const;

 private:
  V8 of_environment(const V8& n) const;

  FacetIrradiance facets_;
  Vec3 constant_{0};          ///< of an environment of one colour
  std::vector<float> image_;  ///< of an image: RGB by normal, rows of equal polar angle from +y, columns of longitude
};

}  // namespace lightmill
