// Size of an image, and the header properties that readers ignore.
#pragma once

#include <cstdint>

namespace lightmill {

/// Properties in a header that change the meaning of pixels, and that readers of scenes ignore. glTF demands this, and
/// other formats have no rule. Pixels count as they are stored, and integers as sRGB, unless the scene says otherwise.
struct IgnoredProperties {
  bool orientation = false;  ///< of Exif, other than upright
  bool gamma = false;        ///< other than that of sRGB
  bool profile = false;      ///< an ICC profile other than sRGB
};

struct ImageSize {
  int width = 0;
  int height = 0;
  std::uint32_t bytes_per_pixel = 4;  ///< as in Texels: 4, 8 or 16
  IgnoredProperties ignored;
  std::uint64_t pixels() const { return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height); }
};

}  // namespace lightmill
