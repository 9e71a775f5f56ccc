#include "common/image/texels.h"

#include <cmath>

namespace lightmill {

Status check_finite(const Texels& texels) {
  for (std::size_t i = 0; i < texels.floats.size(); ++i) {
    if (!std::isfinite(texels.floats[i])) {
      const std::size_t pixel = i / 4;
      const auto width = static_cast<std::size_t>(texels.width);
      return invalid_argument("pixel ({}, {}) is not finite", pixel % width, pixel / width);
    }
  }
  return ok_status();
}

Status check_pixels(int width, int height, std::int64_t max_pixels) {
  return std::int64_t{width} * height <= max_pixels
             ? ok_status()
             : resource_exhausted(
                   "{}x{} pixels are more than the worker's limit of {:.4g} megapixels (--image-megapixels)", width,
                   height, static_cast<double>(max_pixels) / (1 << 20));
}

}  // namespace lightmill
