// Error of a film, estimated from its two halves.
//
// The frame's error is relMSE = mean((x − r)²/(r² + 0.01)) over pixels and channels of the picture x with limit r. For
// halves with nA and nB samples and means a and b, (a − b)²·nA·nB/(nA + nB)² estimates (x − r)². The layer `bias` adds
// the squared bias of gathers. tests/bench/coverage_bench measures how well the estimate holds.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/film/film.h"

namespace lightmill {

/// Estimated relMSE of the frame's beauty. rel_mse ± half_width contains the picture's own relMSE with 95 % confidence.
struct FrameError {
  double rel_mse = 0;
  double half_width = 0;
  bool known = false;  ///< false until every tile has samples in both halves, and for a frame of one pixel
};

/// A tile's part of the estimate.
struct TileError {
  double sum = 0;  ///< of var/(r² + 0.01) over pixels and channels
  /// Variance of `sum`, from differences of neighbouring blocks of 8×8 pixels. An upper bound for one pixel.
  double variance = 0;
  double variance_squares = 0;  ///< sum of squares of the contributions of block pairs
  double terms = 0;             ///< pixels × channels
  bool known = false;           ///< both halves have samples
};

/// `sums` and `bias` (empty without that layer) are laid out as Node::values, for a tile of width × height pixels.
TileError estimate_tile_error(std::span<const float> sums, int width, int height, std::uint32_t channels,
                              Film::HalfCounts counts, std::span<const float> bias = {});

/// Caches the tiles' parts, and recomputes those of changed tiles, so that frequent updates are cheap. Not thread-safe.
class ErrorEstimator {
 public:
  /// Updates at most `max_tiles` changed tiles, in turn, and sums all. Films of at most `max_tiles` tiles get their
  /// exact estimate. The estimate of larger films lags by a few calls.
  FrameError update(const Film& film, std::uint32_t max_tiles = 2048);
  /// Updates all changed tiles. Returns the exact estimate.
  FrameError update_all(const Film& film) { return update(film, std::numeric_limits<std::uint32_t>::max()); }
  /// Updates one tile, so that a later update_all has less to do.
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
