// What a virtual meter reads, with its error.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "common/math/vec.h"
#include "common/scene/document.h"

namespace lightmill {

/// A meter's reading in radiometric and photometric units (common/lights/photometry.h states what RGB values stand
/// for). value ± half_width holds the expectation with 95 % confidence.
struct MeterReading {
  double value = 0, half_width = 0;               ///< in radiometric_unit
  double photometric = 0, photometric_width = 0;  ///< in photometric_unit
  Vec3d rgb{0};                                   ///< in radiometric_unit
  std::uint64_t samples = 0;                      ///< per pixel of the meter's tile; 0: nothing is known yet
};

/// "irradiance", "radiance" or "flux"; "W/m²", "W/(m² sr)" or "W"; "lx", "cd/m²" or "lm".
std::string_view quantity_of(const Meter& meter);
std::string_view radiometric_unit(const Meter& meter);
std::string_view photometric_unit(const Meter& meter);

/// From the sums of the meter's tile over `samples` samples of each of its pixels: `sums[(half * channels + channel) *
/// pixels + pixel]`, R, G, B first. Its pixels are independent estimates of one expectation, so their spread tells the
/// error of their mean; a flux is that mean times the patch's area.
MeterReading read_meter(const Meter& meter, std::span<const float> sums, std::size_t channels, std::uint64_t samples);

}  // namespace lightmill
