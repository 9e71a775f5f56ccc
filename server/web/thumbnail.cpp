#include "server/web/thumbnail.h"

#include <algorithm>

#include "common/image/color.h"
#include "common/image/png.h"

namespace lightmill {
namespace {

/// Scales a coordinate from `from` pixels to `to` pixels.
std::size_t scaled(int at, int from, int to) {
  return static_cast<std::size_t>(std::int64_t{at} * to / from);
}

}  // namespace

Result<std::string> thumbnail_png(const PixelRect& crop, const std::vector<TileSnapshot>& tiles) {
  const int longer = std::max(crop.width, crop.height);
  const int most = std::min(kThumbnailSide, longer);
  RgbImage image;
  image.width = std::max(1, crop.width * most / longer);
  image.height = std::max(1, crop.height * most / longer);
  image.values.assign(3 * image.pixels(), 0.0f);
  std::vector<float> counts(image.pixels(), 0.0f);
  for (const TileSnapshot& tile : tiles) {
    const std::vector<float> rgb = mean_rgb(tile);
    const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
    for (std::size_t i = 0; i < pixels; ++i) {
      const int x = tile.rect.x - crop.x + static_cast<int>(i) % tile.rect.width;
      const int y = tile.rect.y - crop.y + static_cast<int>(i) / tile.rect.width;
      const std::size_t at = scaled(y, crop.height, image.height) * static_cast<std::size_t>(image.width) +
                             scaled(x, crop.width, image.width);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        image.values[channel * image.pixels() + at] += rgb[channel * pixels + i];
      }
      counts[at] += 1;
    }
  }
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    image.values[i] /= std::max(counts[i % image.pixels()], 1.0f);
  }
  return encode_png(image.width, image.height, to_srgb8(image, {}));
}

}  // namespace lightmill
