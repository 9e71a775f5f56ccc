#include "common/image/texels.h"

#include <cmath>

namespace lightmill {

namespace {

Status not_finite(const Texels& texels, std::size_t pixel) {
  const auto width = static_cast<std::size_t>(texels.width);
  return invalid_argument("pixel ({}, {}) is not finite", pixel % width, pixel / width);
}

}  // namespace

Status check_finite(const Texels& texels) {
  for (std::size_t i = 0; i < texels.floats.size(); ++i) {
    if (!std::isfinite(texels.floats[i])) {
      return not_finite(texels, i / 4);
    }
  }
  for (std::size_t pixel = 0; texels.half && pixel < texels.words.size(); ++pixel) {
    for (std::size_t channel = 0; channel < 4; ++channel) {
      constexpr std::uint32_t kExponent = 0x7c00;
      if ((component(texels, pixel, channel) & kExponent) == kExponent) {
        return not_finite(texels, pixel);
      }
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
