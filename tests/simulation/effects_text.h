// Effects of the coordinator as text, one line each: for people who compare two runs, and for hashes of whole runs.
#pragma once

#include <string>

#include "common/base/clock.h"
#include "server/domain/coordinator.h"

namespace lightmill::simulation {

/// All of `effects`. Bulky content (settings, a node's values) stands there as its hash.
std::string effects_text(const Effects& effects);

/// What the coordinator shows at `now`: jobs, workers, counts, demand and its next deadline.
std::string view_text(const Coordinator& coordinator, Time now);

}  // namespace lightmill::simulation
