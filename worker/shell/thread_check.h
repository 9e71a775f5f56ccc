// Check that a worker can have as many threads as it needs, before libraries try to start theirs: those abort.
#pragma once

#include <cstdint>

#include "common/base/status.h"

namespace lightmill {

/// Starts so many threads at once, and ends them. RESOURCE_EXHAUSTED if one cannot start.
Status check_threads(std::uint32_t count);

}  // namespace lightmill
