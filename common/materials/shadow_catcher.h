// Shadow catcher BSDF: a surface that shows the background, darkened by shadows.
#pragma once

#include "common/materials/diffuse.h"

namespace lightmill {

/// Lambertian, with the reflectance that shows the background under unoccluded light. Light scattered by the scene is
/// excluded: a path ends at the next surface.
struct ShadowCatcher8 : Diffuse8 {
  static constexpr bool kEndsPaths = true;

  /// `unoccluded`: irradiance. Channels with none have reflectance 0.
  static ShadowCatcher8 showing(const V8& background, const V8& unoccluded) {
    const auto ratio = [](F8 radiance, F8 irradiance) {
      return select(irradiance > F8(0.0f), radiance * F8(kPi) / irradiance, F8(0.0f));
    };
    return {
        {V8{ratio(background.x, unoccluded.x), ratio(background.y, unoccluded.y), ratio(background.z, unoccluded.z)}}};
  }
};

}  // namespace lightmill
