// The reading of a virtual meter, with its error.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "common/math/vec.h"
#include "common/scene/document.h"

namespace lightmill {

/// A meter's reading in radiometric and photometric units (common/lights/photometry.h defines the meaning of RGB
/// values). The interval value ± half_width contains the expectation with 95 % confidence.
struct MeterReading {
  double value = 0, half_width = 0;               ///< in radiometric_unit
  double photometric = 0, photometric_width = 0;  ///< in photometric_unit
  Vec3d rgb{0};                                   ///< in radiometric_unit
  std::uint64_t samples = 0;                      ///< per pixel of the meter's tile; 0: no reading yet
};

/// "irradiance", "radiance" or "flux"; "W/m²", "W/(m² sr)" or "W"; "lx", "cd/m²" or "lm".
std::string_view quantity_of(const Meter& meter);
std::string_view radiometric_unit(const Meter& meter);
std::string_view photometric_unit(const Meter& meter);

/// The reading from the sums of the meter's whole tile, over `samples` samples of each pixel: `sums[(half * channels +
/// channel) * pixels + pixel]`, R, G, B first. The tile's columns are independent estimates of one expectation, so their
/// spread gives the error of their mean. A flux is the mean times the patch's area.
MeterReading read_meter(const Meter& meter, std::span<const float> sums, std::size_t channels, std::uint64_t samples);

}  // namespace lightmill
