#include "common/image/color.h"

#include <algorithm>
#include <cmath>

#include "common/base/suggestion.h"

namespace lightmill {

float srgb_encode(float linear) {
  if (!(linear > 0.0f)) {
    return 0.0f;
  }
  if (linear >= 1.0f) {
    return 1.0f;
  }
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float srgb_decode(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Result<View> parse_view(std::string_view name) {
  if (name == "plain") {
    return View::plain;
  }
  if (name == "filmic") {
    return View::filmic;
  }
  return invalid_argument("{}", unknown_text("view", name, {"plain", "filmic"}));
}

float filmic_curve(float linear) {
  const double x =
      linear > 0.0f ? std::min(linear, 1e6f) : 0.0f;  // the fraction reaches its limit, 1.03, far below 1e6
  const double y = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
  return static_cast<float>(std::clamp(y, 0.0, 1.0));
}

std::vector<std::uint8_t> to_srgb8(const RgbImage& image, const ViewSettings& settings) {
  const float scale = static_cast<float>(std::exp2(settings.exposure_stops));
  const bool curved = settings.gamma != 1;
  const auto exponent = static_cast<float>(1 / settings.gamma);
  const std::size_t pixels = image.pixels();
  std::vector<std::uint8_t> bytes(3 * pixels);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      const float exposed = image.values[channel * pixels + pixel] * scale;
      float shown = settings.view == View::filmic ? filmic_curve(exposed) : exposed;
      shown = curved ? std::pow(std::max(shown, 0.0f), exponent) : shown;
      bytes[3 * pixel + channel] = static_cast<std::uint8_t>(std::lround(255.0f * srgb_encode(shown)));
    }
  }
  return bytes;
}

}  // namespace lightmill
