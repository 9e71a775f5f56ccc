// Size of an image, read from the file's header.
#pragma once

#include <cstdint>

namespace lightmill {

struct ImageSize {
  int width = 0;
  int height = 0;
  std::uint32_t bytes_per_pixel = 4;  ///< as in Texels: 4, or 16 if a channel has more than eight bits
  std::uint64_t pixels() const { return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height); }
};

}  // namespace lightmill
