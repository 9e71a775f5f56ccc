// What one tile of a film held at one moment, for those who send it: pixels are computed from it later and elsewhere.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/film/film.h"

namespace lightmill {

/// Shares the nodes of the film's forest; cheap to take, and untouched by what the film does next.
struct TileSnapshot {
  PixelRect rect;
  NodeLayout layout;
  std::uint64_t samples = 0;    ///< per pixel
  std::uint64_t samples_a = 0;  ///< of these, in half A
  std::vector<std::shared_ptr<const Node>> forest;
};

TileSnapshot snapshot(const Film& film, TileId tile);

/// The sums over the forest in ascending index order, laid out as Node::values: the bits of Film::sums.
std::vector<float> sums_of(const TileSnapshot& tile);

/// What there is of the layers that are not summed.
FirstValues first_of(const TileSnapshot& tile);

/// The mean of all samples of both halves, planar R, G, B (the first three channels), rows from the top; zero while
/// there are none.
std::vector<float> mean_rgb(const TileSnapshot& tile);

/// What a page draws of one layer of a tile, beauty or another that the film has: half floats, little-endian,
/// interleaved R, G, B, E, rows from the top. R, G and B are the means of all samples (of the first 16, and the nearest
/// of these, of layers that are not summed), one channel thrice where the layer has but one; E is the standard error of
/// the luminance that this pixel's two halves alone tell, |a − b| √(n_a n_b) / (n_a + n_b) of their means a and b (its
/// square has one degree of freedom: average it over a neighbourhood), and −1 while a half is empty and for layers that
/// are not summed. Values beyond ±65504 are that. Empty for layers of single samples, which are no colours.
std::string view_pixels(const TileSnapshot& tile, const LayerPlace& layer = {});

}  // namespace lightmill
