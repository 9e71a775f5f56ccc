// Lights of a pbrt scene.
#pragma once

#include "common/scene_io/load.h"
#include "common/scene_io/pbrt/pbrt_spectra.h"

namespace lightmill {

/// An AreaLightSource "diffuse". pbrt's lights have the luminance 1 of their spectrum, times an rgb, times the scale.
struct PbrtAreaLight {
  RgbColor radiance;  ///< without the power
  double power = 0;   ///< W that each shape radiates; 0: `radiance` is used
  bool two_sided = false;
};
Result<std::optional<PbrtAreaLight>> read_pbrt_area_light(const std::string& type, const PbrtParameters& from,
                                                          PbrtSpectra& spectra, double exposure, Faults& faults);

/// A LightSource. Its radiance or intensity is multiplied by `exposure`.
Result<Light> read_pbrt_light(const std::string& type, const PbrtParameters& from, const Transform& to_scene,
                              PbrtSpectra& spectra, double exposure, FileSource& files, LoadedScene& loaded);

}  // namespace lightmill
