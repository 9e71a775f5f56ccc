#include "common/film/error_estimate.h"

#include <algorithm>

#include "common/base/check.h"

namespace lightmill {
namespace {

constexpr int kBlockSide = 8;  ///< Pixels; wider than what neighbouring pixels share.
constexpr double kNormal95 = 1.959963984540054;
/// Share of the estimate by which it may be off for want of the limit r itself: some 4 % at most on the scenes of
/// tests/bench/coverage_bench. Large frames, whose noise averages out, would else be told too narrow an interval.
constexpr double kDoubt = 0.05;

struct Block {
  double sum = 0;
  double pixels = 0;
};

/// Estimates the variance of the total of all blocks, each pixel's term having a common variance within a
/// neighbourhood: for neighbours with n₁ and n₂ pixels, E[(x₁/n₁ − x₂/n₂)²] = σ²(1/n₁ + 1/n₂).
double variance_of_total(std::span<const Block> blocks) {
  double variance = 0;
  for (std::size_t i = 0; i < blocks.size(); i += 2) {
    const std::size_t other = i + 1 < blocks.size() ? i + 1 : i - 1;
    const Block& x = blocks[i];
    const Block& y = blocks[other];
    const double difference = x.sum / x.pixels - y.sum / y.pixels;
    const double pixel_variance = difference * difference * x.pixels * y.pixels / (x.pixels + y.pixels);
    variance += pixel_variance * (i + 1 < blocks.size() ? x.pixels + y.pixels : x.pixels);
  }
  return variance;
}

/// The means of one channel of a tile: of each half, and of both.
struct Means {
  std::vector<double> a, b, both;
};

/// Estimates a pixel's limit from its mean. A rare bright sample stands in one half alone: it must not make the value
/// that its own error is divided by. So the mean counts as far as both halves of the pixel, or of one beside it, have
/// so much: at the edge of something bright they do.
double limit_of(const Means& means, int width, int height, int x, int y) {
  double supported = -std::numeric_limits<double>::infinity();
  for (int row = std::max(y - 1, 0); row <= std::min(y + 1, height - 1); ++row) {
    for (int column = std::max(x - 1, 0); column <= std::min(x + 1, width - 1); ++column) {
      const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
      supported = std::max(supported, std::min(means.a[i], means.b[i]));
    }
  }
  return std::min(
      means.both[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)],
      supported);
}

}  // namespace

TileError estimate_tile_error(std::span<const float> sums, int width, int height, std::uint32_t channels,
                              Film::HalfCounts counts) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  LM_CHECK(sums.size() == 2 * channels * pixels);
  TileError error;
  error.terms = static_cast<double>(channels) * static_cast<double>(pixels);
  if (counts.a == 0 || counts.b == 0) {
    return error;
  }
  const double na = static_cast<double>(counts.a);
  const double nb = static_cast<double>(counts.b);
  const double weight = na * nb / ((na + nb) * (na + nb));
  std::vector<double> terms(pixels, 0.0);  // of each pixel, over its channels; squares of radiances outgrow a float
  Means means{std::vector<double>(pixels), std::vector<double>(pixels), std::vector<double>(pixels)};
  for (std::uint32_t channel = 0; channel < channels; ++channel) {
    const float* a = sums.data() + channel * pixels;
    const float* b = a + channels * pixels;
    for (std::size_t i = 0; i < pixels; ++i) {
      means.a[i] = a[i] / na;
      means.b[i] = b[i] / nb;
      means.both[i] = (static_cast<double>(a[i]) + b[i]) / (na + nb);
    }
    std::size_t i = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x, ++i) {
        const double difference = means.a[i] - means.b[i];
        const double limit = limit_of(means, width, height, x, y);
        terms[i] += difference * difference * weight / (limit * limit + 0.01);
      }
    }
  }
  // Blocks are visited to and fro, so that successive ones touch. Tiles too small for two blocks compare pixels.
  const int side = width > kBlockSide || height > kBlockSide ? kBlockSide : 1;
  std::vector<Block> blocks;
  for (int top = 0; top < height; top += side) {
    const std::size_t row_begin = blocks.size();
    for (int left = 0; left < width; left += side) {
      Block block;
      for (int y = top; y < std::min(top + side, height); ++y) {
        for (int x = left; x < std::min(left + side, width); ++x) {
          block.sum +=
              terms[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
          block.pixels += 1;
        }
      }
      error.sum += block.sum;
      blocks.push_back(block);
    }
    if (top / side % 2 == 1) {
      std::reverse(blocks.begin() + static_cast<std::ptrdiff_t>(row_begin), blocks.end());
    }
  }
  // A single pixel has nothing beside it. Its term's square stands for the variance: too much by the square of the
  // mean, which no frame of many pixels notices.
  error.variance = blocks.size() > 1 ? variance_of_total(blocks) : error.sum * error.sum;
  error.known = true;
  return error;
}

void ErrorEstimator::refresh(const Film& film, TileId tile) {
  if (film.grid().is_meter(tile)) {
    return;
  }
  entries_.resize(film.grid().picture_tiles());
  const PixelRect rect = film.grid().tile_rect(tile);
  entries_[tile.value] = {
      estimate_tile_error(film.beauty_sums(tile), rect.width, rect.height, kBeautyChannels, film.half_counts(tile)),
      film.version(tile)};
}

FrameError ErrorEstimator::update(const Film& film, std::uint32_t max_tiles) {
  if (current_ && film_version_ == film.version()) {
    return frame_;
  }
  const std::uint32_t tile_count = film.grid().picture_tiles();
  entries_.resize(tile_count);
  current_ = true;
  std::uint32_t refreshed = 0;
  for (std::uint32_t visited = 0; visited < tile_count; ++visited) {
    const TileId tile{next_};
    if (entries_[next_].version != film.version(tile)) {
      if (refreshed == max_tiles) {
        current_ = false;
        break;
      }
      refresh(film, tile);
      ++refreshed;
    }
    next_ = (next_ + 1) % tile_count;
  }
  film_version_ = film.version();
  TileError total{.known = true};
  for (const Entry& entry : entries_) {
    total.sum += entry.error.sum;
    total.variance += entry.error.variance;
    total.terms += entry.error.terms;
    total.known = total.known && entry.error.known;
  }
  frame_ = FrameError{};
  const bool single_pixel = tile_count == 1 && film.grid().tile_rect(TileId{0}).pixel_count() == 1;
  if (total.known && !single_pixel) {
    // The picture's own error is as far from its expectation as the estimate, and independently so: (a + b)/2 − r has
    // the distribution of (a − b)/2. Hence twice the variance.
    const double noise = kNormal95 * std::sqrt(2 * total.variance);
    frame_ = {total.sum / total.terms, std::hypot(noise, kDoubt * total.sum) / total.terms, true};
  }
  return frame_;
}

}  // namespace lightmill
