// Following a job until it ends, across lost connections.
#pragma once

#include <functional>

#include "client/cli/console.h"
#include "client/cli/farm_choice.h"

namespace lightmill::cli {

/// Calls `changed` with every message about the job (pixels too with `tiles`) and returns the job once it has ended. A
/// lost connection is tried again with growing pauses for ten minutes; the console is told, and what the job waits for.
/// CANCELLED if the user interrupts; a private farm whose process ends is an error.
Result<v1::Job> follow_job(Farm& farm, std::uint64_t id, bool tiles, Signals& signals, const Console& console,
                           const std::function<void(const v1::WatchJobResponse&)>& changed);

}  // namespace lightmill::cli
