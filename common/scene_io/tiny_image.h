// Image files of a few texels, for textures that scene files describe by colours.
#pragma once

#include <array>
#include <span>
#include <string>

#include "common/scene/document/values.h"

namespace lightmill {

struct TinyImage {
  float factor = 0;   ///< of the texels. 0: all are black, and there is no file
  std::string bytes;  ///< a Radiance file with components in [0, 1]
};

/// `texels`: rows from the top. There are as many as width × height.
TinyImage tiny_image(int width, int height, std::span<const RgbColor> texels);

/// Two by two texels: the upper row, then the lower one, each from the left.
TinyImage two_by_two_image(const std::array<RgbColor, 4>& texels);

}  // namespace lightmill
