// The readings of a film's virtual meters, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "common/scene/meter_reading.h"

namespace lightmill {

/// A meter of the scene and its reading.
struct NamedReading {
  Meter meter;
  MeterReading reading;
};

/// [{"name", "quantity", "value", "half_width", "unit", "photometric", "photometric_half_width", "photometric_unit",
/// "rgb", "samples"}]. Numbers are null if there are no samples. Half widths have 95 % confidence.
nlohmann::json to_json(const std::vector<NamedReading>& readings);

}  // namespace lightmill
