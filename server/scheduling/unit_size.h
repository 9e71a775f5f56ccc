// How large a unit should be: pure arithmetic on what is known of the worker, the farm and the film.
#pragma once

#include <cstdint>

#include "common/film/sample_range.h"

namespace lightmill {

/// What a result costs besides its bytes, as so many bytes more.
inline constexpr double kBytesOfAResult = 22 * 1024;

/// What decides the size of a unit besides the film.
struct UnitAim {
  double unit_seconds = 1;              ///< how long the worker should take; also the most for one tile on one thread
  double least_seconds = 0.03;          ///< no range is cut to less of a thread's time only to have work for others
  double results_seconds = 0;           ///< all threads together may send one result each in so long
  double seconds_per_pixel_sample = 0;  ///< of one of its threads, for this job's costlier tiles; 0: not known yet
  std::uint32_t threads = 1;            ///< of the worker
  std::uint32_t farm_threads = 1;       ///< of all workers that may render this job
  /// Above 0: tiles have work of their samples in common, which each worker does once and holds for so many samples.
  /// Units are to be many tiles of few samples rather than few tiles of many.
  std::uint32_t shared_samples = 0;
};

/// Samples [first, end) of a tile that nobody has rendered or is rendering.
struct Gap {
  std::uint64_t first = 0;
  std::uint64_t end = 0;
};

/// Sets the three times of `aim`. Each result costs the coordinator the same whatever range it is of: the more threads
/// the farm has, the longer is what each of them works on, so that all together send no more than `bytes_per_second`.
/// `node_bytes`: of a result. A unit takes no less than `unit_seconds`.
void set_times(double unit_seconds, double node_bytes, double bytes_per_second, UnitAim& aim);

/// The range to be leased at the start of `gap` of `tiles` tiles of `tile_pixels` pixels each: the largest dyadic one
/// that the gap, its alignment (hence at most as many samples as went before) and `unit_seconds` allow, but small
/// enough that all threads of the farm find work in the `left` pixel samples that the job still has to give. The first
/// sample of a pixel comes alone, so that a picture is there at once, and so do all until the cost is known; where so
/// many results would come faster than they may, it comes with as many more as take no longer than the results do.
/// Where samples are shared, all of the worker's tiles together take `unit_seconds`, and the range is no longer than
/// what is held.
SampleRange choose_range(const Gap& gap, std::uint64_t tiles, std::uint64_t tile_pixels, std::uint64_t left,
                         const UnitAim& aim);

/// How many of `tiles` tiles that wait for `range` to put into the unit; at least 1, at most `tiles` and
/// kMaxTilesPerUnit.
std::uint32_t choose_tile_count(const SampleRange& range, std::uint64_t tiles, std::uint64_t tile_pixels,
                                const UnitAim& aim);

inline constexpr std::uint32_t kMaxTilesPerUnit = 4096;

}  // namespace lightmill
