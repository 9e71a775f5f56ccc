#include "server/scheduling/unit_size.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/check.h"
#include "common/film/layers.h"

namespace lightmill {
namespace {

/// Tiles per thread of a first unit of unknown cost: 1 to 4. More than one only if the results of all threads arrive
/// within kFirstUnitSeconds.
constexpr double kFirstUnitSeconds = 0.02, kTilesPerThreadAtFirst = 4;
/// Least thread time of a range that is cut for parallelism, because a result costs about 0.7 ms to receive and store.
constexpr double kMinPieceSeconds = 0.03;
/// Pieces to leave for each thread, so that the others have enough work while one is slow.
constexpr std::uint64_t kPiecesPerThread = 4;
/// A first range has at most kFirstSamples, the samples of layers that are not summed.
constexpr std::uint32_t kMaxFirstLevel = std::bit_width(kFirstSamples) - 1;

/// The worker's share of the waiting tiles. This spreads a round over the farm, and units shrink towards its end.
double share_of(std::uint64_t tiles, const UnitAim& aim) {
  const double threads = std::max<std::uint32_t>(aim.threads, 1);
  return std::ceil(static_cast<double>(tiles) * threads / std::max<double>(aim.farm_threads, threads));
}

}  // namespace

void set_times(double unit_seconds, double node_bytes, double bytes_per_second, UnitAim& aim) {
  aim.results_seconds = aim.farm_threads * (node_bytes + kBytesOfAResult) / bytes_per_second;
  aim.least_seconds = std::max(kMinPieceSeconds, aim.results_seconds);
  aim.unit_seconds =
      std::max(unit_seconds, 2 * aim.results_seconds);  // the largest dyadic range has more than half of it
}

SampleRange choose_range(const Gap& gap, std::uint64_t tiles, std::uint64_t tile_pixels, std::uint64_t left,
                         const UnitAim& aim) {
  LM_CHECK(gap.first < gap.end && gap.end <= kMaxSamples);
  std::uint32_t level = 0;
  const bool first = gap.first == 0;
  if (aim.seconds_per_pixel_sample > 0) {
    const auto alignment = first ? kMaxFirstLevel : static_cast<std::uint32_t>(std::countr_zero(gap.first));
    const auto fits = static_cast<std::uint32_t>(std::bit_width(gap.end - gap.first) - 1);
    level = std::min(alignment, fits);
    if (aim.shared_samples > 0) {
      level = std::min(level, static_cast<std::uint32_t>(std::bit_width(aim.shared_samples) - 1));
    }
  }
  const std::uint64_t span = std::uint64_t{1} << level;
  double sample_seconds = static_cast<double>(tile_pixels) * aim.seconds_per_pixel_sample;
  if (aim.shared_samples > 0) {
    sample_seconds *= std::max(1.0, share_of(tiles, aim) / std::max<std::uint32_t>(aim.threads, 1));
  }
  // Limit of a first range: the time in which one result of each of these tiles comes in. If the farm has fewer threads
  // than tiles: one result of each thread.
  const double part_of_threads = static_cast<double>(tiles) / std::max<double>(aim.farm_threads, 1);
  const double most_seconds =
      first ? std::min(aim.results_seconds * std::min(1.0, part_of_threads), aim.unit_seconds) : aim.unit_seconds;
  while (level > 0) {
    const double seconds = std::ldexp(sample_seconds, static_cast<int>(level));
    const std::uint64_t pieces = std::max(tiles * (span >> level), (left >> level) / tile_pixels);
    const bool too_long = seconds > most_seconds;
    const bool too_few =
        pieces < kPiecesPerThread * std::uint64_t{aim.farm_threads} && seconds / 2 >= aim.least_seconds;
    const bool too_much =
        std::ldexp(static_cast<double>(tile_pixels), static_cast<int>(level)) > aim.most_pixel_samples;
    if (!too_long && !too_few && !too_much) {
      break;
    }
    --level;
  }
  return {level, static_cast<std::uint32_t>(gap.first >> level)};
}

std::uint32_t choose_tile_count(const SampleRange& range, std::uint64_t tiles, std::uint64_t tile_pixels,
                                const UnitAim& aim) {
  const double threads = std::max<std::uint32_t>(aim.threads, 1);
  double wanted = std::clamp(kFirstUnitSeconds / aim.results_seconds, 1.0, kTilesPerThreadAtFirst) * threads;
  if (aim.seconds_per_pixel_sample > 0) {
    const double tile_seconds =
        static_cast<double>(tile_pixels) * static_cast<double>(range.count()) * aim.seconds_per_pixel_sample;
    wanted = std::max(std::floor(aim.unit_seconds * threads / tile_seconds), threads);
  }
  const double most = std::min({static_cast<double>(tiles), static_cast<double>(kMaxTilesPerUnit),
                                aim.most_pixel_samples / static_cast<double>(tile_pixels * range.count())});
  return static_cast<std::uint32_t>(std::clamp(std::min(wanted, share_of(tiles, aim)), 1.0, std::max(most, 1.0)));
}

}  // namespace lightmill
