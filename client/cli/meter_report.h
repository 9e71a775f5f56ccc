// What a film's virtual meters read, as JSON and as text.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/scene/meter_reading.h"

namespace lightmill::cli {

/// A meter of the scene and its reading.
struct NamedReading {
  Meter meter;
  MeterReading reading;
};

/// [{"name", "quantity", "value", "half_width", "unit", "photometric", "photometric_half_width", "photometric_unit",
/// "rgb", "samples"}]; numbers are null while nothing is known. Half widths state 95 % confidence.
nlohmann::json to_json(const std::vector<NamedReading>& readings);

/// "0.1807 ± 0.0003 W/m², 123.4 ± 0.2 lx".
std::string reading_text(const NamedReading& reading);

}  // namespace lightmill::cli
