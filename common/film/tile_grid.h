// Division of a film into tiles of 64×64 pixels.
#pragma once

#include <cstdint>

#include "common/base/ids.h"

namespace lightmill {

inline constexpr int kTileSize = 64;        ///< pixels on a side
inline constexpr int kMaxFilmSide = 65536;  ///< pixels
/// Whether a film may be so wide or high.
constexpr bool is_film_side(int pixels) {
  return pixels >= 1 && pixels <= kMaxFilmSide;
}
inline constexpr int kMeterRow = 131072;  ///< row of the first meter's tile, below every film
inline constexpr std::uint32_t kMaxMeters = 256;

/// A rectangle of the full film's pixels. x points right, y down, and (0,0) is the upper left pixel.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  std::int64_t pixel_count() const { return std::int64_t{width} * height; }
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

/// Divides the crop of a film into tiles. Tiles are those of the full film, aligned to multiples of kTileSize and
/// clipped to the crop. They are numbered row by row.
///
/// The tiles of the scene's virtual meters follow, one per meter. A crop does not clip them. They are no part of the
/// picture. Each of their pixels is an independent estimate of what the meter reads.
class TileGrid {
 public:
  TileGrid() = default;
  /// `crop` must lie within the film and not be empty.
  explicit TileGrid(const PixelRect& crop, std::uint32_t meters = 0);

  std::uint32_t tile_count() const { return picture_tiles() + meters_; }  ///< including meters' tiles
  std::uint32_t picture_tiles() const { return static_cast<std::uint32_t>(columns_ * rows_); }
  bool is_meter(TileId tile) const { return tile.value >= picture_tiles(); }
  /// Of all tiles, including meters' tiles.
  std::uint64_t pixel_count() const {
    return static_cast<std::uint64_t>(crop_.pixel_count()) + std::uint64_t{meters_} * kTileSize * kTileSize;
  }
  int columns() const { return columns_; }
  const PixelRect& crop() const { return crop_; }
  PixelRect tile_rect(TileId tile) const;

 private:
  PixelRect crop_;
  int first_column_ = 0;
  int first_row_ = 0;
  int columns_ = 0;
  int rows_ = 0;
  std::uint32_t meters_ = 0;
};

/// The rectangle of a meter's tile, and the meter of a rectangle.
inline PixelRect meter_rect(std::uint32_t meter) {
  return {0, kMeterRow + static_cast<int>(meter) * kTileSize, kTileSize, kTileSize};
}
inline bool is_meter_rect(const PixelRect& rect) {
  return rect.y >= kMeterRow;
}
inline std::uint32_t meter_of(const PixelRect& rect) {
  return static_cast<std::uint32_t>((rect.y - kMeterRow) / kTileSize);
}

}  // namespace lightmill
