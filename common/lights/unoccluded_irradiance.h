// Noise-free irradiance of a surface without occlusion. Shadow catchers compare their irradiance with it.
#pragma once

#include <vector>

#include "common/lights/facet_irradiance.h"
#include "common/lights/light_table.h"

namespace lightmill {

/// Immutable once built, thread-safe. Lights and emissive surfaces outside the table do not count. None may have an
/// emission exponent.
class UnoccludedIrradiance {
 public:
  UnoccludedIrradiance() = default;
  explicit UnoccludedIrradiance(const LightTable& lights);

  /// On surfaces at `p` with unit normals `n`, in W/m². `lights` must be those of the constructor. The error for an
  /// environment image is some thousandths. For a small sun in the image, it is some hundredths of the sun's largest
  /// irradiance where the sun is within 2° of the surface's horizon.
  V8 at(const LightTable& lights, const V8& p, const V8& n, M8 lanes) const;

 private:
  V8 of_environment(const V8& n) const;

  FacetIrradiance facets_;
  Vec3 constant_{0};          ///< of a constant environment
  std::vector<float> image_;  ///< of an image: RGB by normal, in rows of polar angle from +y and columns of longitude
};

}  // namespace lightmill
