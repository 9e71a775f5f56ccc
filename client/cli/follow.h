// Waiting for a job across lost connections.
#pragma once

#include <functional>

#include "client/cli/console.h"
#include "client/cli/farm_choice.h"

namespace lightmill::cli {

/// Calls `changed` with every message about the job, with pixels if `tiles`. Returns the job once it has ended. Retries
/// a lost connection for ten minutes with growing pauses. The console says so, and says what the job waits for.
/// CANCELLED if the user interrupts. An error if a process of the local farm ends.
Result<v1::Job> follow_job(Farm& farm, std::uint64_t id, bool tiles, Signals& signals, const Console& console,
                           const std::function<void(const v1::WatchJobResponse&)>& changed);

}  // namespace lightmill::cli
