// Rules for job specifications. All code that accepts a job, or reads a stored one, applies them.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/farm/job.h"

namespace lightmill {

// Every check returns INVALID_ARGUMENT. Checks of a single number say what it must be, and the caller names it. The
// others name the field.

Status check_request_id(std::string_view id);
Status check_goal_seconds(double seconds);
Status check_goal_error(double error);

/// The most samples per pixel of a frame, so that no tile has more than kMaxSamples.
std::uint64_t most_samples(const Goal& goal);
/// Checks each limit by itself.
Status check_goal(const Goal& goal);
/// Also checks whether a job on `crop` can end by the goal.
Status check_goal(const Goal& goal, const PixelRect& crop);
/// Whether the halves of a film by this method differ by its error. Not for photon-map, which shows the same photons in
/// all samples.
bool method_has_error(std::string_view method);
/// Checks whether a film by this method can reach this error. 0: no error is asked for.
Status check_method_error(std::string_view method, double error);
Status check_audit_share(double share);

/// Checks the film's size, and that the crop is inside.
Status check_crop(int width, int height, const PixelRect& crop);
/// Checks the film's size, the crop and the number of meters. grid_of needs valid ones.
Status check_grid(const RenderSettings& settings);
/// Like check_grid, and checks the layers.
Status check_film(const RenderSettings& settings);

/// Checks whether workers can render this, by each of `candidates` if there are any.
Status check_spec(const JobSpec& spec, std::span<const std::string> candidates = {});

}  // namespace lightmill
