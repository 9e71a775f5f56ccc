#include "common/scene_io/tiny_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// Radiance's RGBE (Ward 1991) of a colour whose largest component is at most 1.
void put_rgbe(const RgbColor& color, std::string& out) {
  const float largest = std::max({color.r, color.g, color.b});
  if (largest < 1e-30f) {
    out.append(4, '\0');
    return;
  }
  int exponent = 0;
  std::frexp(largest, &exponent);
  const auto mantissa = [&](float value) {
    return static_cast<char>(static_cast<int>(std::min(255.0f, std::round(std::ldexp(value, 8 - exponent)))));
  };
  out += {mantissa(color.r), mantissa(color.g), mantissa(color.b), static_cast<char>(exponent + 128)};
}

}  // namespace

TinyImage tiny_image(int width, int height, std::span<const RgbColor> texels) {
  TinyImage out;
  for (const RgbColor& texel : texels) {
    out.factor = std::max({out.factor, texel.r, texel.g, texel.b});
  }
  if (!(out.factor > 0)) {
    return {};
  }
  out.bytes = fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", height, width);
  for (const RgbColor& texel : texels) {
    put_rgbe({texel.r / out.factor, texel.g / out.factor, texel.b / out.factor}, out.bytes);
  }
  return out;
}

TinyImage two_by_two_image(const std::array<RgbColor, 4>& texels) {
  return tiny_image(2, 2, texels);
}

}  // namespace lightmill
