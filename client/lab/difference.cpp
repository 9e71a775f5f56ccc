#include "client/lab/difference.h"

#include <cmath>

#include "common/image/color.h"
#include "common/image/png.h"

namespace lightmill::lab {
namespace {

constexpr double kFloor = 0.1;  // limits the noise of dark pixels, as 0.01 does in relMSE
constexpr double kFull = 0.25;

}  // namespace

Result<std::string> difference_png(const RgbImage& picture, const RgbImage& reference) {
  const std::size_t pixels = picture.pixels();
  const auto mean = [&](const RgbImage& image, std::size_t i) {
    return (double{image.values[i]} + image.values[pixels + i] + image.values[2 * pixels + i]) / 3;
  };
  std::vector<std::uint8_t> bytes(3 * pixels, 0);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double r = mean(reference, i);
    const double off = (mean(picture, i) - r) / (std::abs(r) + kFloor) / kFull;
    const double strength = std::isfinite(off) ? std::min(std::abs(off), 1.0) : 1.0;
    const auto full = static_cast<std::uint8_t>(std::lround(255 * std::sqrt(strength)));
    const auto half = static_cast<std::uint8_t>(full / 2);
    bytes[3 * i] = off < 0 ? 0 : full;
    bytes[3 * i + 1] = off < 0 ? half : static_cast<std::uint8_t>(full / 4);
    bytes[3 * i + 2] = off < 0 ? full : 0;
  }
  return encode_png(picture.width, picture.height, bytes);
}

Result<std::string> picture_png(const RgbImage& picture) {
  return encode_png(picture.width, picture.height, to_srgb8(picture, ViewSettings{}));
}

}  // namespace lightmill::lab
