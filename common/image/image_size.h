// Size of an image, read from the file's header.
#pragma once

#include <cstdint>

namespace lightmill {

struct ImageSize {
  std::uint64_t pixels = 0;
  std::uint32_t bytes_per_pixel = 4;  ///< as in Texels: 4, or 16 if a channel has more than eight bits
};

}  // namespace lightmill
