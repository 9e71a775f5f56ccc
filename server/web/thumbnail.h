// Small picture of a film, for lists.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "server/assembly/tile_snapshot.h"

namespace lightmill {

inline constexpr int kThumbnailSide = 128;
/// Films with more tiles have no thumbnail, because adding up their pixels would take too long.
inline constexpr std::uint32_t kMostThumbnailTiles = 8192;

/// An 8-bit sRGB PNG whose longer side has at most kThumbnailSide pixels. Each is the mean of the crop's pixels that it
/// covers; black without samples.
Result<std::string> thumbnail_png(const PixelRect& crop, const std::vector<TileSnapshot>& tiles);

}  // namespace lightmill
