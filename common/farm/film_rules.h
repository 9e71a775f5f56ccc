// Which films there can be.
#pragma once

#include "common/base/status.h"
#include "common/farm/job.h"

namespace lightmill {

/// INVALID_ARGUMENT naming the field, unless the settings' crop lies within a film of a size that is possible: only
/// then is there a grid_of.
Status check_crop(const RenderSettings& settings);
/// The same, and of its layers.
Status check_film(const RenderSettings& settings);

}  // namespace lightmill
