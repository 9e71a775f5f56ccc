#include "common/methods/primary_rays.h"

namespace lightmill {

void fill_pixel_seeds(const PixelRect& tile, std::uint64_t seed, std::uint32_t half, std::vector<std::uint32_t>& out) {
  out.clear();
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      out.push_back(pixel_seed(seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), half));
    }
  }
  out.resize(out.size() + 8, 0);  // reads are eight wide
}

}  // namespace lightmill
