// A picture of a few pixels for lists.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "server/assembly/tile_snapshot.h"

namespace lightmill {

inline constexpr int kThumbnailSide = 128;
/// A film of more tiles has no thumbnail: its pixels would take too long to add up.
inline constexpr std::uint32_t kMostThumbnailTiles = 8192;

/// An 8-bit sRGB PNG whose longer side has at most kThumbnailSide pixels, each the mean of the crop's pixels that fall
/// into it; black where there are no samples.
Result<std::string> thumbnail_png(const PixelRect& crop, const std::vector<TileSnapshot>& tiles);

}  // namespace lightmill
