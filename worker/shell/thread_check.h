// Check that enough threads can start. Libraries abort if they cannot start theirs.
#pragma once

#include <cstdint>

#include "common/base/status.h"

namespace lightmill {

/// Starts `count` threads at once, and ends them. RESOURCE_EXHAUSTED if one cannot start.
Status check_threads(std::uint32_t count);

}  // namespace lightmill
