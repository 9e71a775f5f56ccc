// Figures that follow from a job's spec or its film, and what a job may become. Private to server/domain.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/film/error_estimate.h"
#include "server/domain/coordinator.h"

namespace lightmill {

class Job;

/// Bytes of the nodes that a finished film keeps: as many for each tile as the sample goal has dyadic parts (at least
/// two with a goal in error), or, with a goal in seconds, as any count may have that it can reach in that time.
std::uint64_t finished_bytes(const JobSpec& spec);
std::string_view name_of(JobState state);
std::string describe(const Goal& goal);
/// "0.0098 ± 0.0003": a number and its half width, which has two digits.
std::string interval_text(double value, double half_width);

/// The goal of a job that is extended; INVALID_ARGUMENT unless it asks for more than before.
Result<Goal> extended_goal(const Job& job, const Extension& to, Time now);

/// Pixel samples until the job, whose film has this error, will probably end; infinite if unknown, or if time alone
/// ends it.
double expected_pixel_samples(const Job& job, const FrameError& error);
/// Seconds until the job, whose film has this error, will probably end at `samples_per_second`; infinite if unknown.
double expected_seconds(const Job& job, const FrameError& error, double samples_per_second, Time now);

/// Whether the halves of the job's film differ by its error: photon-dots shows the same photons in all samples.
bool has_error(const JobSpec& spec);

/// Whether a done job's film has what its end says: the samples or the error that were asked for, or where time has
/// ended it, every tile samples [0, n), n > 0.
bool is_whole(const Job& job);

}  // namespace lightmill
