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

/// Values as half floats, little-endian, clamped to ±65504. Their number must be a multiple of 4.
std::string half_bytes(const std::vector<float>& values);

/// Pixels of one layer of a tile for the page: half_bytes of interleaved R, G, B, E, rows from the top. Empty for
/// layers of single samples.
/// - R, G, B: mean of all samples, or of the first 16 for layers that are not summed (for `depth`, the nearest). One
///   channel stands for all three.
/// - E: standard error of the luminance from the pixel's halves with means a and b, |a − b| √(n_a n_b) / (n_a + n_b).
///   Its square has one degree of freedom, so average it over a neighbourhood. −1 with an empty half, or not summed.
std::string view_pixels(const TileSnapshot& tile, const LayerSlice& layer = {});

}  // namespace lightmill
