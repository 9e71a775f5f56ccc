#include "common/wire/meter_json.h"

#include <nlohmann/json.hpp>

namespace lightmill {

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

}  // namespace lightmill
