// Text of the coordinator's effects, one line each: to compare two runs, and to hash whole runs.
#pragma once

#include <string>

#include "common/base/clock.h"
#include "server/domain/coordinator.h"

namespace lightmill::simulation {

/// All of `effects`. Bulky content (settings, a node's values) appears as its hash.
std::string effects_text(const Effects& effects);

/// The coordinator's view at `now`: jobs, workers, counts, demand and its next deadline.
std::string view_text(const Coordinator& coordinator, Time now);

}  // namespace lightmill::simulation
