#include "client/cli/meter_report.h"

#include <cmath>

namespace lightmill::cli {
namespace {

/// A value up to the second digit of its error, but at most seven digits. Numbers from 1e6, and very small ones, have
/// an exponent.
std::string with_error(double value, double half_width) {
  if (!(half_width > 1e-7 * std::abs(value))) {
    return fmt::format("{:.7g} ± {:.2g}", value, half_width);
  }
  const double largest = std::max(std::abs(value), half_width);
  const int last_place = static_cast<int>(std::floor(std::log10(half_width))) - 1;
  if (largest >= 1e-4 && largest < 1e6) {
    const int decimals = std::max(-last_place, 0);
    return fmt::format("{:.{}f} ± {:.{}f}", value, decimals, half_width, decimals);
  }
  const int first_place = static_cast<int>(std::floor(std::log10(std::max(std::abs(value), half_width / 10))));
  return fmt::format("{:.{}e} ± {:.1e}", value, std::max(first_place - last_place, 0), half_width);
}

}  // namespace

std::string reading_text(const NamedReading& reading) {
  const MeterReading& r = reading.reading;
  if (r.samples == 0) {
    return "no samples yet";
  }
  return fmt::format("{} {}, {} {}", with_error(r.value, r.half_width), radiometric_unit(reading.meter),
                     with_error(r.photometric, r.photometric_width), photometric_unit(reading.meter));
}

}  // namespace lightmill::cli
