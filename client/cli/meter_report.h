// Readings of a film's virtual meters, as text.
#pragma once

#include <string>

#include "common/wire/meter_json.h"

namespace lightmill::cli {

/// "0.1807 ± 0.0003 W/m², 123.4 ± 0.2 lx".
std::string reading_text(const NamedReading& reading);

}  // namespace lightmill::cli
