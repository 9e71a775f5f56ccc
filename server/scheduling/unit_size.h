// Size of a unit, as pure functions of the worker, the farm and the film.
#pragma once

#include <cstdint>
#include <limits>

#include "common/film/sample_range.h"

namespace lightmill {

/// Fixed cost of a result, in bytes of equal cost.
inline constexpr double kBytesOfAResult = 22 * 1024;

/// Inputs for the size of a unit, besides the film.
struct UnitAim {
  double unit_seconds = 1;              ///< target time of the worker; also the most for one tile on one thread
  double least_seconds = 0.03;          ///< least thread time of a range that is cut to give work to others
  double results_seconds = 0;           ///< time in which all threads together may send one result each
  double seconds_per_pixel_sample = 0;  ///< of one of its threads, for this job's costlier tiles; 0: unknown
  /// Limit of the unit. It has at least one sample of one tile.
  double most_pixel_samples = std::numeric_limits<double>::infinity();
  std::uint32_t threads = 1;       ///< of the worker
  std::uint32_t farm_threads = 1;  ///< of all workers of the farm that can get work
  /// If above 0, tiles share work of their samples. Each worker does it once, and keeps it for this number of samples.
  /// Then units have many tiles with few samples, not few tiles with many samples.
  std::uint32_t shared_samples = 0;
};

/// Samples [first, end) of a tile that are neither rendered nor leased.
struct Gap {
  std::uint64_t first = 0;
  std::uint64_t end = 0;
};

/// Sets the three times of `aim`. Each result costs the coordinator the same, whatever its range. So on a farm with
/// more threads the ranges are longer, and all threads together send at most `bytes_per_second`. `node_bytes`: size of
/// a result. A unit takes at least `unit_seconds`.
void set_times(double unit_seconds, double node_bytes, double bytes_per_second, UnitAim& aim);

/// Range to lease at the start of `gap`, for `tiles` tiles of `tile_pixels` pixels each. It is the largest dyadic range
/// within these limits:
/// - the gap, and its alignment (so at most as many samples as came before);
/// - `unit_seconds` of thread time for each tile; if samples are shared, for all of the worker's tiles together;
/// - `shared_samples`, if above 0;
/// - `most_pixel_samples`;
/// - small enough that all threads of the farm find work in the `left` free pixel samples of the job.
/// The first sample of a pixel comes alone, so that a picture appears soon. So do all samples while the cost is
/// unknown. If single samples would give too many results, a first range takes up to `results_seconds`.
SampleRange choose_range(const Gap& gap, std::uint64_t tiles, std::uint64_t tile_pixels, std::uint64_t left,
                         const UnitAim& aim);

/// How many of `tiles` tiles that wait for `range` go into the unit: at least 1, at most `tiles` and kMaxTilesPerUnit.
std::uint32_t choose_tile_count(const SampleRange& range, std::uint64_t tiles, std::uint64_t tile_pixels,
                                const UnitAim& aim);

inline constexpr std::uint32_t kMaxTilesPerUnit = 4096;

}  // namespace lightmill
