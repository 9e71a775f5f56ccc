// Figures of jobs that follow from a spec or a film: sizes, expected work and time, and new goals.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/film/error_estimate.h"
#include "server/domain/coordinator.h"

namespace lightmill {

class Job;

/// Most bytes of the nodes of a finished film. Each tile has a node for each dyadic part of its sample count. With an
/// error goal these are at least two. With a time goal, the reachable count with the most parts is assumed.
std::uint64_t finished_bytes(const JobSpec& spec);
std::string describe(const Goal& goal);

/// Goal of an extended job. INVALID_ARGUMENT unless it asks for more than before.
Result<Goal> extended_goal(const Job& job, const Extension& to, Time now);

/// Expected pixel samples until the job ends, if its film has this error. Infinite if unknown, or if only time ends it.
double expected_pixel_samples(const Job& job, const FrameError& error);
/// Expected seconds until the job ends, if its film has this error. Infinite if unknown.
double expected_seconds(const Job& job, const FrameError& error, Time now);

/// Whether a done job's film still meets its goal: the samples, or the error. If time ended the job, every tile must
/// have samples [0, n), n > 0.
bool is_whole(const Job& job);

}  // namespace lightmill
