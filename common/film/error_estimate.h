// The error of a film, estimated from its two halves.
//
// The frame's error is relMSE = mean((x − r)²/(r² + 0.01)) over pixels and channels of the picture x, r being its
// limit. With a and b the means of the halves, (a−b)²/4 estimates (x − r)² where both have as many samples (generally
// (a−b)²·nA·nB/(nA+nB)²). Where the film has a layer `bias`, of gathers at one radius less those at half of it, the
// product of its two halves estimates the square of that without bias, and so, times a factor, that of the gathers' own
// bias, which (x − r)² has too. r² is estimated from the pixel and those beside it, so that neither rare bright samples
// nor the edges of bright things deceive (see error_estimate.cpp); tests/bench/coverage_bench measures how well that
// holds.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/film/film.h"

namespace lightmill {

/// The frame's relMSE (of beauty) as estimated: rel_mse ± half_width holds the picture's own with 95 % confidence.
struct FrameError {
  double rel_mse = 0;
  double half_width = 0;
  bool known = false;  ///< false until every tile has samples in both halves, and for a frame of one pixel
};

/// One tile's part of the estimate.
struct TileError {
  double sum = 0;  ///< of var/(r² + 0.01) over pixels and channels
  /// Of `sum`, from the differences of neighbouring blocks of 8×8 pixels; an upper bound for one pixel.
  double variance = 0;
  double variance_squares = 0;  ///< of the parts that each pair of blocks has in it
  double terms = 0;             ///< pixels × channels
  bool known = false;           ///< both halves have samples
};

/// `sums`, and those of the layer `bias` or none, laid out as Node::values for a tile of width × height pixels.
TileError estimate_tile_error(std::span<const float> sums, int width, int height, std::uint32_t channels,
                              Film::HalfCounts counts, std::span<const float> bias = {});

/// Keeps the tiles' parts and recomputes those whose tile has changed, so that asking often is cheap.
class ErrorEstimator {
 public:
  /// Brings at most `max_tiles` changed tiles up to date, going round, and sums all up. Films of at most `max_tiles`
  /// tiles get their exact estimate each time; larger ones one that trails by a few calls.
  FrameError update(const Film& film, std::uint32_t max_tiles = 2048);
  /// Brings all changed tiles up to date: the exact estimate of any film.
  FrameError update_all(const Film& film) { return update(film, std::numeric_limits<std::uint32_t>::max()); }
  /// Brings one tile up to date, so that a later update_all has less to do.
  void refresh(const Film& film, TileId tile);

 private:
  struct Entry {
    TileError error;
    std::uint64_t version = 0;
  };
  std::vector<Entry> entries_;
  std::uint32_t next_ = 0;
  std::uint64_t film_version_ = 0;
  bool current_ = false;
  FrameError frame_;
};

}  // namespace lightmill
