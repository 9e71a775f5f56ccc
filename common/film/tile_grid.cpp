#include "common/film/tile_grid.h"

#include <algorithm>

#include "common/base/check.h"

namespace lightmill {

TileGrid::TileGrid(const PixelRect& crop, std::uint32_t meters)
    : crop_(crop),
      first_column_(crop.x / kTileSize),
      first_row_(crop.y / kTileSize),
      columns_((crop.x + crop.width - 1) / kTileSize - first_column_ + 1),
      rows_((crop.y + crop.height - 1) / kTileSize - first_row_ + 1),
      meters_(meters) {
  LM_CHECK(meters <= kMaxMeters);
  LM_CHECK(crop.x >= 0 && crop.y >= 0 && crop.width > 0 && crop.height > 0);
}

PixelRect TileGrid::tile_rect(TileId tile) const {
  LM_CHECK(tile.value < tile_count(), "tile {} of {}", tile.value, tile_count());
  if (is_meter(tile)) {
    return meter_rect(tile.value - picture_tiles());
  }
  const int column = first_column_ + static_cast<int>(tile.value) % columns_;
  const int row = first_row_ + static_cast<int>(tile.value) / columns_;
  const int left = std::max(column * kTileSize, crop_.x);
  const int top = std::max(row * kTileSize, crop_.y);
  const int right = std::min((column + 1) * kTileSize, crop_.x + crop_.width);
  const int bottom = std::min((row + 1) * kTileSize, crop_.y + crop_.height);
  return {left, top, right - left, bottom - top};
}

}  // namespace lightmill
