// Spectra of scene files as linear RGB with Rec. 709 primaries.
//
// Colours are those of the CIE's 1931 observer, whose matching functions are the sums of Gaussians of Wyman, Sloan and
// Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions". They are scaled so that D65
// is exactly white. Components below 0, of colours outside of Rec. 709, become 0.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/materials/metals.h"
#include "common/scene/document/values.h"
#include "common/scene_io/file_finder.h"

namespace lightmill {

/// Values at ascending wavelengths, linear between them, zero outside.
struct Spectrum {
  std::vector<double> wavelengths_nm;
  std::vector<double> values;

  double at(double nm) const;
};

inline constexpr std::size_t kMaxSpectrumSamples = 100'000;

/// A spectrum of pairs of a wavelength in nanometres and a value: these numbers, or those of a text file if `file`
/// names one (comments begin with #). Refused unless there is a pair, the wavelengths ascend, and the values are in
/// [0, 1e20].
Result<Spectrum> read_spectrum(const std::vector<double>& numbers, const std::string& file, FileSource& files);

/// Planck's law, up to a factor. `kelvin` must be positive.
Spectrum blackbody(double kelvin);

/// The colour of a surface that reflects this much, in D65. A grey one is exact.
RgbColor reflected_color(const Spectrum& reflectance);
/// The colour of light with this spectrum, of luminance 1. Nothing if it is black.
std::optional<RgbColor> light_color(const Spectrum& light);
/// The colour of light with this spectrum, where one that is 1 everywhere has luminance 1.
RgbColor radiated_color(const Spectrum& light);
/// light_color of a standard illuminant of the CIE: "A", "D50", "D65", "F1" … "F12". Nothing if there is none.
std::optional<RgbColor> illuminant_color(std::string_view name);
/// The values at 650, 550 and 450 nm, as those of metals (common/materials/metals.h).
RgbColor at_red_green_blue(const Spectrum& spectrum);

/// The metal of an element: "Ag", "Al", "Au", "Cr", "Cu", "Ni", "Pt". Nothing if it is unknown.
std::optional<Metal> metal_of_symbol(std::string_view symbol);

/// The index of refraction of a Schott glass at 587.6 nm: "BK7", "BAF10", "FK51A", "LASF9", "SF5", "SF10", "SF11".
/// Nothing if it is unknown.
std::optional<double> glass_ior(std::string_view name);

}  // namespace lightmill
