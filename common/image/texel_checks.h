// What is checked of a decoded image, wherever it was decoded.
#pragma once

#include "common/base/status.h"
#include "common/image/texels.h"

namespace lightmill {

/// INVALID_ARGUMENT that names the first pixel with a value that is infinite or no number.
Status check_finite(const Texels& texels);

/// RESOURCE_EXHAUSTED for an image of more than `max_pixels`.
Status check_pixels(int width, int height, std::int64_t max_pixels);

}  // namespace lightmill
