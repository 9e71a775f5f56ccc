// What a job may be, and small facts read off it. Private to server/domain.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/farm/job.h"

namespace lightmill {

struct Job;

/// INVALID_ARGUMENT naming the field, unless the farm can render this.
Status check_spec(const JobSpec& spec);

/// Bytes of the nodes that a finished film keeps: as many for each tile as the sample goal has dyadic parts, or,
/// with a goal in seconds, as any count may have that it can reach in that time.
std::uint64_t finished_bytes(const JobSpec& spec);
std::string_view name_of(JobState state);
std::string describe(const Goal& goal);

/// Whether a done job's film has what its end says: its sample goal, or without having reached that, every tile samples
/// [0, n).
bool is_whole(const Job& job);

}  // namespace lightmill
