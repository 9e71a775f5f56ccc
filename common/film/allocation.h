// How the frame's samples are shared out between its tiles: two-stage adaptive sampling.
//
// A pilot, whose samples enter no film, says where the noise is (planner/tile_noise.h). What each tile gets then is
// fixed before its first sample: no tile's own samples decide how many it has, which would be biased.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/ids.h"
#include "common/base/status.h"

namespace lightmill {

/// Where the frame is to have n samples per pixel on average, a tile has n·2^shift. Tiles without one, and all of the
/// default, have n.
class Allocation {
 public:
  static constexpr int kLeastShift = -2, kMostShift = 2;

  Allocation() = default;
  /// One shift a tile; INVALID_ARGUMENT if one is out of range.
  static Result<Allocation> of(std::vector<std::int8_t> shifts);

  bool even() const { return shifts_.empty(); }
  std::span<const std::int8_t> shifts() const { return shifts_; }
  int shift(TileId tile) const { return tile.value < shifts_.size() ? shifts_[tile.value] : 0; }
  int least_shift() const { return least_shift_; }  ///< of all tiles, and at most 0

  /// Samples per pixel that a tile has where the frame has `frame`: rounded up.
  std::uint64_t of_tile(TileId tile, std::uint64_t frame) const {
    const int s = shift(tile);
    return s >= 0 ? frame << s : (frame + (std::uint64_t{1} << -s) - 1) >> -s;
  }
  /// The most samples of the frame of which a tile with so many has its part.
  std::uint64_t of_frame(TileId tile, std::uint64_t count) const {
    const int s = shift(tile);
    return s >= 0 ? count >> s : count << -s;
  }

  /// The least samples of the frame of which a tile's part is as many.
  std::uint64_t frame_for(TileId tile, std::uint64_t count) const {
    const int s = shift(tile);
    return s >= 0 ? (count + (std::uint64_t{1} << s) - 1) >> s : count == 0 ? 0 : ((count - 1) << -s) + 1;
  }

  friend bool operator==(const Allocation&, const Allocation&) = default;

 private:
  std::vector<std::int8_t> shifts_;
  int least_shift_ = 0;
};

/// What is known of a tile beforehand.
struct TileNoise {
  double pixels = 0;
  double variance = 0;  ///< relative, of one sample: mean over pixels and channels of var/(r² + 0.01)
  double cost = 0;      ///< of one sample of one pixel, in any unit
};

/// What an allocation does to a frame of as many samples on average.
struct Gain {
  Allocation allocation;
  double gain = 1;  ///< by how much relMSE × cost is less than if all tiles had the same
};

/// About the least relMSE × cost for a frame of n samples on average: never more, and less only where what is left is
/// too little for any tile's next step. `shared_cost`: of what a sample costs but once, for all tiles that have it
/// (photons). A tile's error is taken to be half with twice the samples, and four times with half of them. Even, where
/// nothing is gained.
Gain allocate(std::span<const TileNoise> tiles, double shared_cost);

}  // namespace lightmill
