// Rules of what a job may be, and figures that follow from its spec or its film. Private to server/domain.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/film/error_estimate.h"
#include "server/domain/coordinator.h"

namespace lightmill {

class Job;

/// What a frame may have at most, so that no tile has more than kMaxSamples.
std::uint64_t most_samples(const Goal& goal);
/// INVALID_ARGUMENT naming the field, unless a job on `crop` can have this goal.
Status check_goal(const Goal& goal, const PixelRect& crop);
/// INVALID_ARGUMENT naming the field, unless the farm can render this, by each of `candidates` if there are any.
Status check_spec(const JobSpec& spec, std::span<const std::string> candidates = {});

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
