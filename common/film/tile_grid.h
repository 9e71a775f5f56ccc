// How a film is cut into tiles of 64×64 pixels.
#pragma once

#include <cstdint>

#include "common/base/ids.h"

namespace lightmill {

inline constexpr int kTileSize = 64;        ///< Pixels on a side.
inline constexpr int kMaxFilmSide = 65536;  ///< Pixels.

/// A rectangle of pixels of the full film; x to the right, y down, (0,0) the upper left pixel.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  std::int64_t pixel_count() const { return std::int64_t{width} * height; }
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

/// Cuts the crop of a film into tiles. Tiles are those of the full film, aligned to multiples of kTileSize and clipped
/// to the crop, numbered row by row among those that the crop touches.
class TileGrid {
 public:
  TileGrid() = default;
  /// `crop` must lie within the film and not be empty.
  explicit TileGrid(const PixelRect& crop);

  std::uint32_t tile_count() const { return static_cast<std::uint32_t>(columns_ * rows_); }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  const PixelRect& crop() const { return crop_; }
  PixelRect tile_rect(TileId tile) const;

 private:
  PixelRect crop_;
  int first_column_ = 0;
  int first_row_ = 0;
  int columns_ = 0;
  int rows_ = 0;
};

}  // namespace lightmill
