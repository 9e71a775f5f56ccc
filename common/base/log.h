// Logging by spdlog: one line per event that matters, to standard error, as text or as JSON lines.
#pragma once

#include <spdlog/spdlog.h>

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Sets up the process's logger. `level` is trace, debug, info, warn, error or off; `format` is text or json; `program`
/// stands in every line. Call once, before threads start.
Status start_logging(std::string_view program, std::string_view level, std::string_view format);

}  // namespace lightmill
