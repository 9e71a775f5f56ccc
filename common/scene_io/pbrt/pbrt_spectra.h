// Spectra in pbrt's parameters as colours and indices of refraction.
#pragma once

#include "common/scene_io/file_finder.h"
#include "common/scene_io/pbrt/pbrt_parameters.h"
#include "common/scene_io/spectrum.h"

namespace lightmill {

/// Converts values of the types rgb, blackbody and spectrum (by values, by name, or by the name of a file). Each
/// function gives nothing if there is no parameter of the name, or after an error, which is noted at the parameters.
class PbrtSpectra {
 public:
  explicit PbrtSpectra(FileSource& files) : files_(files) {}

  /// An rgb as it is. Else the colour of the light's spectrum, of luminance 1: pbrt scales lights so.
  std::optional<RgbColor> light(const PbrtParameters& from, std::string_view name);
  /// Each component in [0, 1].
  std::optional<RgbColor> reflectance(const PbrtParameters& from, std::string_view name);
  /// Each component at least 0, as of a medium.
  std::optional<RgbColor> coefficient(const PbrtParameters& from, std::string_view name);
  /// Of metals: n or k at three wavelengths, in [0, kMaxComplexIndex]. `part` is "eta" or "k".
  struct Indices {
    RgbColor eta, k;
  };
  /// Those whose reflectance along the normal has the colour of a measured metal: both parameters are spectra without a
  /// metal's name. Else nothing.
  std::optional<Indices> measured_metal(const PbrtParameters& from, std::string_view eta_name, std::string_view k_name);
  std::optional<RgbColor> metal(const PbrtParameters& from, std::string_view name, std::string_view part);
  /// Of glass: a number, the value of a spectrum at 587.6 nm, or the name of a glass.
  double ior(const PbrtParameters& from, std::string_view name, double fallback);

 private:
  /// The values of a spectrum. `parameter` must be of that type.
  std::optional<Spectrum> samples(const PbrtParameters& from, const PbrtParameter& parameter);
  std::optional<RgbColor> rgb(const PbrtParameters& from, const PbrtParameter& parameter, double high);
  std::optional<RgbColor> surface(const PbrtParameters& from, std::string_view name, double high);

  FileSource& files_;
};

}  // namespace lightmill
