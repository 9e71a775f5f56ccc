#include "client/cli/meter_report.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace lightmill::cli {
namespace {

/// A value to two digits of its error, or to seven where it has none.
std::string with_error(double value, double half_width) {
  if (!(half_width > 1e-7 * std::abs(value))) {
    return fmt::format("{:.7g}", value);
  }
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(half_width)));
  if (decimals < 0 || decimals > 12) {
    return fmt::format("{:.4g} ± {:.2g}", value, half_width);
  }
  return fmt::format("{:.{}f} ± {:.{}f}", value, decimals, half_width, decimals);
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
