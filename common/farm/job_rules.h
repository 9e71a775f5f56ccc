// All rules of what a job may ask for. Whoever takes a job in, or reads one back, asks here.
#pragma once

#include <span>
#include <string>

#include "common/base/status.h"
#include "common/farm/job.h"

namespace lightmill {

// Every check gives INVALID_ARGUMENT. Those of one number say what it must be, and their caller names it; the others
// name the field.

Status check_goal_seconds(double seconds);
Status check_goal_error(double error);

/// What a frame may have at most, so that no tile has more than kMaxSamples.
std::uint64_t most_samples(const Goal& goal);
/// Each limit by itself.
Status check_goal(const Goal& goal);
/// Also whether a job on `crop` can end by it.
Status check_goal(const Goal& goal, const PixelRect& crop);
Status check_verify_share(double share);

/// Whether the crop lies within a film of a size that is possible.
Status check_crop(int width, int height, const PixelRect& crop);
/// Of the settings, and how many meters they have: only then is there a grid_of.
Status check_grid(const RenderSettings& settings);
/// The same, and its layers.
Status check_film(const RenderSettings& settings);

/// Whether workers can render this, by each of `candidates` if there are any.
Status check_spec(const JobSpec& spec, std::span<const std::string> candidates = {});

}  // namespace lightmill
