// A surface that stands for one in the photograph behind the scene: it shows the background, darkened by shadows.
#pragma once

#include "common/materials/diffuse.h"

namespace lightmill {

/// Lambert's, with the reflectance that shows the background under the light that would arrive if nothing were in its
/// way. Light scattered by the scene is not part of it: a path ends where it meets the next surface.
struct Holdout8 : Diffuse8 {
  static constexpr bool kEndsPaths = true;

  /// `unoccluded`: irradiance. Channels without any have reflectance 0.
  static Holdout8 showing(const V8& background, const V8& unoccluded) {
    const auto ratio = [](F8 radiance, F8 irradiance) {
      return select(irradiance > F8(0.0f), radiance * F8(kPi) / irradiance, F8(0.0f));
    };
    return {
        {V8{ratio(background.x, unoccluded.x), ratio(background.y, unoccluded.y), ratio(background.z, unoccluded.z)}}};
  }
};

}  // namespace lightmill
