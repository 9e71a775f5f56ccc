// Snapshot of one tile of a film. Pixels are computed from it later, on another thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/film/film.h"

namespace lightmill {

/// Shares the nodes of the film's forest. It is cheap, and later changes of the film do not affect it.
struct TileSnapshot {
  PixelRect rect;
  NodeLayout layout;
  std::uint64_t samples = 0;    ///< per pixel
  std::uint64_t samples_a = 0;  ///< of these, in half A
  std::vector<std::shared_ptr<const Node>> forest;
};

TileSnapshot snapshot(const Film& film, TileId tile);

/// Sums over the forest in ascending index order, laid out as Node::values. They have the bits of sums_over (film.h).
std::vector<float> sums_of(const TileSnapshot& tile);

/// Values of the layers that are not summed.
FirstValues first_of(const TileSnapshot& tile);

/// Mean of all samples of both halves: planar R, G, B (the first three channels), rows from the top. Zero without
/// samples.
std::vector<float> mean_rgb(const TileSnapshot& tile);

/// Pixels of one layer of a tile for the page: half floats, little-endian, interleaved R, G, B, E, rows from the top.
/// - R, G, B: mean of all samples. For layers that are not summed, the mean of the first 16, or the nearest of them. A
///   layer with one channel has it three times.
/// - E: standard error of the luminance from this pixel's two halves, |a − b| √(n_a n_b) / (n_a + n_b) with their means
///   a and b. Its square has one degree of freedom, so average it over a neighbourhood. −1 while a half is empty, and
///   for layers that are not summed.
/// Values are clamped to ±65504. Empty for layers of single samples, which are not colours.
std::string view_pixels(const TileSnapshot& tile, const LayerSlice& layer = {});

}  // namespace lightmill
