// Checks of decoded images.
#pragma once

#include "common/base/status.h"
#include "common/image/texels.h"

namespace lightmill {

/// INVALID_ARGUMENT, naming the first pixel that is infinite or NaN.
Status check_finite(const Texels& texels);

/// RESOURCE_EXHAUSTED for an image of more than `max_pixels`.
Status check_pixels(int width, int height, std::int64_t max_pixels);

}  // namespace lightmill
