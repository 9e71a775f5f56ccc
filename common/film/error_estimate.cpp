#include "common/film/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/rel_mse.h"
#include "common/math/simd.h"

namespace lightmill {
namespace {

constexpr int kBlockSide = 8;  ///< pixels; wider than the correlation between pixels
/// Relative uncertainty of the estimate because the limit r is unknown. It holds on the scenes of
/// tests/bench/coverage_bench. Without it, the interval of large frames, whose noise averages out, would be too narrow.
constexpr double kDoubt = 0.1;

// A pixel's error is divided by its limit r. The pixel's mean is a bad estimate of r: a rare bright sample would be
// compared with itself, and the error far too small. So r is the lower median of the neighbours' means, clamped to the
// means of the pixel's own halves. A bright sample raises only one half. At textures and edges, where neighbours
// mislead, the clamp leaves little choice. Next to something much brighter, a pixel may show a part of it that few
// samples hit. There the mean is better.
constexpr float kEdge = 4;  ///< times as bright, in both halves

// The product of the two halves of the layer `bias` estimates, without bias, the squared difference between gathers
// with full and half radius. This factor converts it to the square of their bias. In a smooth patch the bias grows with
// the squared radius, and the factor is (4/3)². But bias is largest at the edges of caustics. At u radii from a
// straight edge a disc has the bias b(u) = ±(acos u − u √(1 − u²))/π, and ∫b(u)² du is 4.33 ∫(b(u) − b(2u))² du.
constexpr double kBiasFactor = 4.33;

struct Block {
  double sum = 0;
  double pixels = 0;
};

/// Adds to the estimate of the variance of the sum over all blocks. Pixels of a neighbourhood have one variance σ². For
/// neighbours with n₁ and n₂ pixels, E[(x₁/n₁ − x₂/n₂)²] = σ²(1/n₁ + 1/n₂).
void add_variance(std::span<const Block> blocks, TileError& tile) {
  for (std::size_t i = 0; i < blocks.size(); i += 2) {
    const std::size_t other = i + 1 < blocks.size() ? i + 1 : i - 1;
    const Block& x = blocks[i];
    const Block& y = blocks[other];
    const double difference = x.sum / x.pixels - y.sum / y.pixels;
    const double pixel_variance = difference * difference * x.pixels * y.pixels / (x.pixels + y.pixels);
    const double part = pixel_variance * (i + 1 < blocks.size() ? x.pixels + y.pixels : x.pixels);
    tile.variance += part;
    tile.variance_squares += part * part;
  }
}

/// 97.5 % quantile of Student's t distribution, by the Cornish-Fisher expansion. Its error is within 0.1 % from 5
/// degrees of freedom on, and 2 % at 3.
double student_quantile(double freedom) {
  constexpr double z = 1.959963984540054, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * freedom) + (5 * z5 + 16 * z3 + 3 * z) / (96 * freedom * freedom) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * freedom * freedom * freedom);
}

/// A plane of values with a border of one pixel, which repeats the outermost values. Eight values can be read from any
/// position.
class BorderedPlane {
 public:
  BorderedPlane(int width, int height)
      : stride_(width + 2),
        height_(height),
        values_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height + 2) + 8) {}

  int stride() const { return stride_; }
  float* row(int y) { return &values_[static_cast<std::size_t>((y + 1) * stride_ + 1)]; }
  const float* row(int y) const { return &values_[static_cast<std::size_t>((y + 1) * stride_ + 1)]; }
  void fill_border() {
    for (int y = 0; y < height_; ++y) {
      float* const values = row(y);
      values[-1] = values[0];
      values[stride_ - 2] = values[stride_ - 3];
    }
    std::copy_n(row(0) - 1, stride_, row(-1) - 1);
    std::copy_n(row(height_ - 1) - 1, stride_, row(height_) - 1);
  }

 private:
  int stride_, height_;
  std::vector<float> values_;
};

void order(F8& low, F8& high) {
  const F8 least = min(low, high);
  high = max(low, high);
  low = least;
}

/// The fourth smallest of the eight neighbours, for eight pixels, by Batcher's merge sort. The compiler drops the
/// unused exchanges.
F8 lower_median_around(const float* p, int stride) {
  F8 v[8] = {F8::load(p - stride - 1), F8::load(p - stride),     F8::load(p - stride + 1), F8::load(p - 1),
             F8::load(p + 1),          F8::load(p + stride - 1), F8::load(p + stride),     F8::load(p + stride + 1)};
  constexpr int kExchanges[19][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {1, 2}, {5, 6},
                                     {0, 4}, {1, 5}, {2, 6}, {3, 7}, {2, 4}, {3, 5}, {1, 2}, {3, 4}, {5, 6}};
  for (const auto& exchange : kExchanges) {
    order(v[exchange[0]], v[exchange[1]]);
  }
  return v[3];
}

F8 greatest_around(const float* p, int stride) {
  const auto of_three = [](const float* q) { return max(max(F8::load(q - 1), F8::load(q)), F8::load(q + 1)); };
  return max(max(of_three(p - stride), of_three(p + stride)), max(F8::load(p - 1), F8::load(p + 1)));
}

/// One channel of a tile: the means of its halves, and the limits r.
class ChannelMeans {
 public:
  ChannelMeans(int width, int height)
      : width_(width),
        low_(width, height),
        high_(width, height),
        both_(width, height),
        limits_(static_cast<std::size_t>(width + 8)) {}

  void set(const float* sums_a, const float* sums_b, int height, Film::HalfCounts counts) {
    const double all = static_cast<double>(counts.a) + static_cast<double>(counts.b);
    const auto scale_a = static_cast<float>(1.0 / static_cast<double>(counts.a));
    const auto scale_b = static_cast<float>(1.0 / static_cast<double>(counts.b));
    const auto share_a = static_cast<float>(static_cast<double>(counts.a) / all);
    for (int y = 0; y < height; ++y, sums_a += width_, sums_b += width_) {
      float* const low = low_.row(y);
      float* const high = high_.row(y);
      float* const both = both_.row(y);
      for (int x = 0; x < width_; ++x) {
        const float a = sums_a[x] * scale_a, b = sums_b[x] * scale_b;
        low[x] = std::min(a, b);
        high[x] = std::max(a, b);
        both[x] = share_a * a + (1 - share_a) * b;
      }
    }
    low_.fill_border();
    both_.fill_border();
  }

  /// Adds ((a − b)² · weight + bias) / (r² + 0.01) of a row's pixels to `terms`. `bias`: squared bias by pixel, or
  /// null.
  void add_terms(int y, double weight, const double* bias, double* terms) {
    const float* const low = low_.row(y);
    const float* const high = high_.row(y);
    find_limits(low, high, both_.row(y));
    for (int x = 0; x < width_; ++x) {
      const double limit = limits_[static_cast<std::size_t>(x)];
      const double difference = static_cast<double>(high[x]) - low[x];  // squares of radiances overflow a float
      terms[x] += (difference * difference * weight + (bias == nullptr ? 0 : bias[x])) / (limit * limit + kRelMseFloor);
    }
  }

 private:
  /// Sets r of a row's pixels, eight at a time.
  void find_limits(const float* low, const float* high, const float* both) {
    for (int x = 0; x < width_; x += 8) {
      const F8 least = F8::load(low + x), greatest = F8::load(high + x);
      const F8 usual = lower_median_around(both + x, both_.stride());
      const F8 allowed = max(least, min(usual, greatest));
      const M8 edge = greatest_around(low + x, low_.stride()) > F8(kEdge) * greatest;
      select(edge, F8::load(both + x), allowed).store(&limits_[static_cast<std::size_t>(x)]);
    }
  }

  int width_;
  BorderedPlane low_, high_, both_;
  std::vector<float> limits_;  ///< of one row
};

}  // namespace

TileError estimate_tile_error(std::span<const float> sums, int width, int height, std::uint32_t channels,
                              Film::HalfCounts counts, std::span<const float> bias) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  LM_CHECK(sums.size() == 2 * channels * pixels && (bias.empty() || bias.size() == sums.size()));
  TileError error;
  error.terms = static_cast<double>(channels) * static_cast<double>(pixels);
  if (counts.a == 0 || counts.b == 0) {
    return error;
  }
  const double na = static_cast<double>(counts.a);
  const double nb = static_cast<double>(counts.b);
  const double weight = na * nb / ((na + nb) * (na + nb));
  std::vector<double> terms(pixels, 0.0);  // by pixel, over its channels; squares of radiances overflow a float
  ChannelMeans means(width, height);
  std::vector<double> bias_squares(bias.empty() ? 0 : pixels);
  for (std::uint32_t channel = 0; channel < channels; ++channel) {
    const std::size_t first = channel * pixels, other_half = channels * pixels;
    means.set(sums.data() + first, sums.data() + first + other_half, height, counts);
    for (std::size_t i = 0; i < bias_squares.size(); ++i) {
      bias_squares[i] = kBiasFactor * (bias[first + i] / na) * (bias[first + other_half + i] / nb);
    }
    for (int y = 0; y < height; ++y) {
      const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
      means.add_terms(y, weight, bias.empty() ? nullptr : &bias_squares[row], &terms[row]);
    }
  }
  // Blocks are visited in alternating direction, so that successive ones touch. Tiles too small for two blocks compare
  // pixels.
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
  // A single pixel has no neighbour, so the square of its term stands for the variance. It is too large by the square
  // of the mean. In frames of many pixels this does not matter.
  if (blocks.size() > 1) {
    add_variance(blocks, error);
  } else {
    error.variance = error.sum * error.sum;
    error.variance_squares = error.variance * error.variance;
  }
  error.known = true;
  return error;
}

void ErrorEstimator::refresh(const Film& film, TileId tile) {
  if (film.grid().is_meter(tile)) {
    return;
  }
  entries_.resize(film.grid().picture_tiles());
  const PixelRect rect = film.grid().tile_rect(tile);
  entries_[tile.value] = {estimate_tile_error(film.beauty_sums(tile), rect.width, rect.height, kBeautyChannels,
                                              film.half_counts(tile), film.bias_sums(tile)),
                          film.version(tile)};
}

FrameError ErrorEstimator::update(const Film& film, std::uint32_t max_tiles) {
  if (current_ && film_version_ == film.version()) {
    return frame_;
  }
  if (film.min_samples() < 2) {  // a tile has an empty half
    return FrameError{};
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
    total.variance_squares += entry.error.variance_squares;
    total.terms += entry.error.terms;
    total.known = total.known && entry.error.known;
  }
  frame_ = FrameError{};
  const bool single_pixel = tile_count == 1 && film.grid().tile_rect(TileId{0}).pixel_count() == 1;
  if (total.known && !single_pixel) {
    // The picture's own error deviates from its expectation as much as the estimate does. (a + b)/2 − r has the fourth
    // moment of (a − b)/2. For normal noise the two are independent, so the variance is doubled. For noise with heavy
    // tails this is too much, because both are large together.
    //
    // The variance itself is estimated from pairs of blocks. Each gives one degree of freedom. Only degrees with noise
    // count (Satterthwaite 1946). The factor 3 is from E[v²] = 3σ⁴ for one degree.
    const double freedom =
        total.variance_squares > 0 ? 3 * total.variance * total.variance / total.variance_squares : 1;
    const double noise = student_quantile(std::max(freedom, 2.0)) * std::sqrt(2 * total.variance);
    frame_ = {total.sum / total.terms, std::hypot(noise, kDoubt * total.sum) / total.terms, true};
  }
  return frame_;
}

}  // namespace lightmill
