// What an image file says of itself before it is decoded.
#pragma once

#include <cstdint>

namespace lightmill {

struct ImageSize {
  std::uint64_t pixels = 0;
  std::uint32_t bytes_per_pixel = 4;  ///< as Texels: 4, or 16 where a channel has more than eight bits
};

}  // namespace lightmill
