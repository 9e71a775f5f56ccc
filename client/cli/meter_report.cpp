#include "client/cli/meter_report.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace lightmill::cli {
namespace {

/// A value to the second digit of its error, or to seven digits where that is less. Numbers from 1e6 on, and very small
/// ones, have an exponent.
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

nlohmann::json to_json(const std::vector<NamedReading>& readings) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [meter, reading] : readings) {
    const auto number = [known = reading.samples > 0](double value) {
      return known ? nlohmann::json(value) : nlohmann::json(nullptr);
    };
    list.push_back({{"name", meter.name},
                    {"quantity", quantity_of(meter)},
                    {"value", number(reading.value)},
                    {"half_width", number(reading.half_width)},
                    {"unit", radiometric_unit(meter)},
                    {"photometric", number(reading.photometric)},
                    {"photometric_half_width", number(reading.photometric_width)},
                    {"photometric_unit", photometric_unit(meter)},
                    {"rgb", {number(reading.rgb.x), number(reading.rgb.y), number(reading.rgb.z)}},
                    {"samples", reading.samples}});
  }
  return list;
}

std::string reading_text(const NamedReading& reading) {
  const MeterReading& r = reading.reading;
  if (r.samples == 0) {
    return "no samples yet";
  }
  return fmt::format("{} {}, {} {}", with_error(r.value, r.half_width), radiometric_unit(reading.meter),
                     with_error(r.photometric, r.photometric_width), photometric_unit(reading.meter));
}

}  // namespace lightmill::cli
