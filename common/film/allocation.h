// Adaptive sampling in two stages: how the frame's samples are divided among its tiles.
//
// A pilot measures where the noise is (planner/tile_noise.h). Its samples enter no film. Each tile's share is fixed
// before its first sample. A tile's own samples never decide how many it has, because that would be biased.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/ids.h"
#include "common/base/status.h"

namespace lightmill {

/// A frame with n samples per pixel on average has n·2^shift in a tile. Tiles without a shift have n, and so do all
/// tiles of a default Allocation.
class Allocation {
 public:
  static constexpr int kMinDoublings = -2, kMaxDoublings = 2;

  Allocation() = default;
  /// One shift per tile. INVALID_ARGUMENT if one is out of range.
  static Result<Allocation> of(std::vector<std::int8_t> shifts);

  bool even() const { return shifts_.empty(); }
  std::span<const std::int8_t> shifts() const { return shifts_; }
  int shift(TileId tile) const { return tile.value < shifts_.size() ? shifts_[tile.value] : 0; }
  int least_shift() const { return least_shift_; }  ///< over all tiles, and at most 0

  /// Samples per pixel of a tile when the frame has `frame`, rounded up.
  std::uint64_t of_tile(TileId tile, std::uint64_t frame) const {
    const int s = shift(tile);
    return s >= 0 ? frame << s : (frame + (std::uint64_t{1} << -s) - 1) >> -s;
  }
  /// The largest frame count whose share a tile with `count` samples has.
  std::uint64_t of_frame(TileId tile, std::uint64_t count) const {
    const int s = shift(tile);
    return s >= 0 ? count >> s : count << -s;
  }

  /// The smallest frame count at which a tile's share is `count`.
  std::uint64_t frame_for(TileId tile, std::uint64_t count) const {
    const int s = shift(tile);
    return s >= 0 ? (count + (std::uint64_t{1} << s) - 1) >> s : count == 0 ? 0 : ((count - 1) << -s) + 1;
  }

  friend bool operator==(const Allocation&, const Allocation&) = default;

 private:
  std::vector<std::int8_t> shifts_;
  int least_shift_ = 0;
};

/// The pilot's measurements of a tile.
struct TileNoise {
  double pixels = 0;
  double variance = 0;  ///< relative variance of one sample: mean over pixels and channels of var/(r² + 0.01)
  double cost = 0;      ///< of one sample of one pixel, in any unit
};

/// An allocation, and its gain for a frame with the same mean sample count.
struct AllocationResult {
  Allocation allocation;
  double gain = 1;  ///< relMSE × cost of equal shares, over that of this allocation
};

/// Minimizes relMSE × cost, approximately, for a frame with n samples on average. It never takes more than n. It takes
/// less only if the rest is too small for the next step of any tile. `shared_cost`: cost per sample that all tiles
/// share (photons).
///
/// The model of a tile's error: half with twice the samples, four times with half of them. Returns equal shares where
/// nothing is gained.
AllocationResult allocate(std::span<const TileNoise> tiles, double shared_cost);

}  // namespace lightmill
