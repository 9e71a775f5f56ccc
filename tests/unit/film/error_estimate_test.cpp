#include "common/film/error_estimate.h"

#include <gtest/gtest.h>

#include <random>

namespace lightmill {
namespace {

/// Standard normal deviates by Box and Muller.
class Normal {
 public:
  explicit Normal(std::uint32_t seed) : bits_(seed) {}
  double operator()() {
    const double u = (bits_() + 0.5) / 4294967296.0;
    const double v = (bits_() + 0.5) / 4294967296.0;
    return std::sqrt(-2 * std::log(u)) * std::cos(6.283185307179586 * v);
  }

 private:
  std::mt19937 bits_;
};

/// A node of 2^level samples whose pixels have mean `mean` and standard deviation `sigma` per sample.
NodePtr noisy_node(const Film& film, TileId tile, std::uint32_t level, double mean, double sigma, Normal& normal) {
  Node node{{level, 0}, std::vector<float>(film.expected_values(tile, {level, 0})), 0};
  const double half = static_cast<double>(node.range.count()) / 2;
  for (float& value : node.values) {
    value = static_cast<float>(half * mean + std::sqrt(half) * sigma * normal());
  }
  return std::make_shared<const Node>(std::move(node));
}

FrameError estimate(std::uint32_t seed, const PixelRect& crop, double mean, double sigma) {
  Film film(TileGrid(crop), 3);
  Normal normal(seed);
  for (std::uint32_t tile = 0; tile < film.grid().tile_count(); ++tile) {
    film.merge(TileId{tile}, noisy_node(film, TileId{tile}, 4, mean, sigma, normal));
  }
  return ErrorEstimator().update(film);
}

TEST(ErrorEstimate, FindsAKnownVariance) {
  // The mean of 16 samples of sigma 0.1 around 1 has variance 0.01/16. The average over 20 × 12,288 values has a
  // relative standard deviation of 0.29 % and a bias of about 0.1 %. 2 % is more than six deviations: a false alarm in
  // 1e9 runs.
  double sum = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    sum += estimate(seed, {0, 0, 64, 64}, 1.0, 0.1).rel_mse / 20;
  }
  const double expected = 0.01 / 16 / 1.01;
  EXPECT_NEAR(sum, expected, 0.02 * expected);
}

TEST(ErrorEstimate, UnequalHalvesEstimateTheMeansVariance) {
  // Three samples: two in A, one in B. The mean of all three has variance sigma²/3.
  double sum = 0;
  constexpr int kPixels = 64 * 64;
  Normal normal(5);
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::vector<float> sums(2 * kPixels);
    for (int i = 0; i < kPixels; ++i) {
      sums[i] = static_cast<float>(2 + 0.05 * std::sqrt(2.0) * normal());
      sums[kPixels + i] = static_cast<float>(1 + 0.05 * normal());
    }
    const TileError tile = estimate_tile_error(sums, 64, 64, 1, {2, 1});
    sum += tile.sum / tile.terms / 20;
  }
  const double expected = 0.0025 / 3 / 1.01;
  EXPECT_NEAR(sum, expected, 0.03 * expected);  // six standard deviations of sqrt(2 / 81,920)
}

/// relMSE of the picture that `sums` make, whose limit is `mean` everywhere.
double own_error(const Film& film, double mean) {
  const std::vector<float> sums = film.beauty_sums(TileId{0});
  const double samples = static_cast<double>(film.samples(TileId{0}));
  double sum = 0;
  for (std::size_t i = 0; i < sums.size() / 2; ++i) {
    const double x = (static_cast<double>(sums[i]) + sums[sums.size() / 2 + i]) / samples;
    sum += (x - mean) * (x - mean) / (mean * mean + 0.01);
  }
  return sum / (static_cast<double>(sums.size()) / 2);
}

TEST(ErrorEstimate, IntervalCoversThePicturesErrorInNineteenOfTwentyRuns) {
  // Over 12,288 values the estimate and the picture's own error have a relative variance of 2/12,288 each. So 95 % of
  // their differences are below 3.54 % of the error. Together with 10 % for the limit that is 10.6 %, six standard
  // deviations.
  constexpr int kRuns = 400;
  int held = 0;
  double width = 0;
  for (std::uint32_t seed = 0; seed < kRuns; ++seed) {
    Film film(TileGrid({0, 0, 64, 64}), 3);
    Normal normal(seed);
    film.merge(TileId{0}, noisy_node(film, TileId{0}, 4, 1.0, 0.1, normal));
    const FrameError error = ErrorEstimator().update(film);
    held += std::abs(error.rel_mse - own_error(film, 1.0)) <= error.half_width;
    width += error.half_width / error.rel_mse / kRuns;
  }
  EXPECT_GE(held, kRuns - 1);
  EXPECT_NEAR(width, 0.106, 0.002);  // the average of 400 has a standard deviation of 0.0001
}

/// The estimate's sum over a tile of ones. One pixel's halves have the means `a` and `b`. Both halves of its neighbour
/// have `beside`.
double estimate_with(double a, double b, double beside) {
  constexpr int kSide = 16;
  std::vector<float> sums(2 * kSide * kSide, 8.0f);  // eight samples in each half
  const auto set = [&](int x, int y, double in_a, double in_b) {
    sums[y * kSide + x] = static_cast<float>(8 * in_a);
    sums[(kSide + y) * kSide + x] = static_cast<float>(8 * in_b);
  };
  set(8, 8, a, b);
  set(8, 9, beside, beside);
  return estimate_tile_error(sums, kSide, kSide, 1, {8, 8}).sum;
}

TEST(ErrorEstimate, ARareBrightSampleIsComparedWithThePictureWithoutIt) {
  // 101 in one half, 1 in the other, and ones around them: the mean is off by 50 from 1.
  EXPECT_NEAR(estimate_with(101, 1, 1), 2500 / 1.01, 1);
  EXPECT_NEAR(estimate_with(1, 101, 1), 2500 / 1.01, 1);
}

TEST(ErrorEstimate, AnEdgeOfABrightAreaIsComparedWithTheMean) {
  // Both halves of the neighbour have 500, five times as much. So the bright area covers the pixel in part.
  EXPECT_NEAR(estimate_with(101, 1, 500), 2500.0 / (51 * 51 + 0.01), 1e-3);
}

/// Light that a disc of this radius gathers at (x, 0) from light 1 left of x = 0, by strips.
double gathered_at(double x, double radius) {
  constexpr int kStrips = 2000;
  double lit = 0, all = 0;
  for (int i = 0; i < kStrips; ++i) {
    const double at = -1 + (i + 0.5) * 2 / kStrips;
    const double height = std::sqrt(1 - at * at);
    all += height;
    lit += x + radius * at < 0 ? height : 0;
  }
  return lit / all;
}

TEST(ErrorEstimate, BiasOfGathersFollowsFromHalfTheRadius) {
  // The edge of light 0.2 on a ground of 1, gathered on discs. Picture and layer have noise besides the bias. The
  // layer's noise exceeds its signal, but is independent in the two halves.
  constexpr int kSide = 64;
  constexpr double kRadius = 5, kLight = 0.2, kNoise = 0.02, kSamples = 8;
  Normal normal(11);
  double stated = 0, truth = 0;
  for (int repeat = 0; repeat < 10; ++repeat) {
    std::vector<float> sums(2 * kSide * kSide), bias(2 * kSide * kSide);
    for (int x = 0; x < kSide; ++x) {
      const double place = x - 31.7 + 0.1 * repeat;
      const double gathered = gathered_at(place, kRadius), closer = gathered_at(place, kRadius / 2);
      const double right = 1 + (place < 0 ? kLight : 0);
      for (int i = x; i < 2 * kSide * kSide; i += kSide) {
        sums[static_cast<std::size_t>(i)] = static_cast<float>(kSamples * (1 + kLight * gathered + kNoise * normal()));
        bias[static_cast<std::size_t>(i)] =
            static_cast<float>(kSamples * (kLight * (gathered - closer) + kNoise * normal()));
      }
      truth += kSide * std::pow(kLight * gathered + 1 - right, 2) / (right * right + 0.01);
    }
    stated += estimate_tile_error(sums, kSide, kSide, 1, {8, 8}, bias).sum -
              estimate_tile_error(sums, kSide, kSide, 1, {8, 8}).sum;
  }
  // The noise of 40,960 products of deviations, 4.33 · 0.02² / 1.2 each, has a deviation of 0.3. The truth is 14.4, so
  // six deviations are 12 %. There are only 5 pixels to a radius.
  EXPECT_NEAR(truth, 14.4, 0.5);
  EXPECT_NEAR(stated / truth, 1, 0.12 + 0.05);
}

TEST(ErrorEstimate, BrightSamplesInATextureAreNotHiddenByItsBrightSpots) {
  // Pixels of lognormal brightness r (σ = 0.5). One of 1,000 samples brings a tenth of the light. The others have a
  // deviation of 0.2 r a sample. So the mean of n has variance r² (0.04 + 0.1²·(1000 − 1))/n, and few pixels hold the
  // second part. The true error is that of the values themselves.
  std::mt19937 bits(7);
  std::normal_distribution<> normal;
  constexpr int kSide = 64, kTiles = 16;
  for (const int n : {16, 64, 256, 1024}) {
    double stated = 0, truth = 0;
    for (int tile = 0; tile < kTiles; ++tile) {
      std::vector<float> sums(2 * kSide * kSide);
      for (int i = 0; i < kSide * kSide; ++i) {
        const double r = std::exp(0.5 * normal(bits) - 1.2);
        double both = 0;
        for (int half = 0; half < 2; ++half) {
          const int bright = std::binomial_distribution<int>(n / 2, 0.001)(bits);
          const double sum = 0.9 * r * n / 2 + 0.2 * r * std::sqrt(n / 2.0) * normal(bits) + 100 * r * bright;
          sums[static_cast<std::size_t>(half * kSide * kSide + i)] = static_cast<float>(sum);
          both += sum / n;
        }
        truth += (both - r) * (both - r) / (r * r + 0.01);
      }
      const auto half = static_cast<std::uint64_t>(n / 2);
      stated += estimate_tile_error(sums, kSide, kSide, 1, {half, half}).sum;
    }
    // With this many values (hundreds of bright samples) the true error varies by about 5 %. If bright samples were
    // compared with their mean, the ratio would be 0.03 to 0.86.
    EXPECT_GT(stated / truth, 0.9) << n;
    EXPECT_LT(stated / truth, 1.25) << n;
  }
}

TEST(ErrorEstimate, IsUnknownUntilAllTilesHaveBothHalves) {
  Film film(TileGrid({0, 0, 128, 64}), 3);
  ErrorEstimator estimator;
  EXPECT_FALSE(estimator.update(film).known);
  Normal normal(1);
  film.merge(TileId{0}, noisy_node(film, TileId{0}, 4, 1, 0.1, normal));
  EXPECT_FALSE(estimator.update(film).known);
  film.merge(TileId{1}, noisy_node(film, TileId{1}, 0, 1, 0.1, normal));
  EXPECT_FALSE(estimator.update(film).known);  // one sample: half B is empty
  film.merge(TileId{1}, noisy_node(film, TileId{1}, 4, 1, 0.1, normal));
  EXPECT_TRUE(estimator.update(film).known);
}

// A film of 65×65 pixels has a corner tile of one pixel. It must not hide the error of the other tiles.
TEST(ErrorEstimate, ATileOfOnePixelLeavesTheFramesErrorKnown) {
  const double expected = 0.01 / 16 / 1.01;
  double sum = 0, widths = 0, plain_widths = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const FrameError error = estimate(seed, {0, 0, 65, 65}, 1.0, 0.1);
    EXPECT_TRUE(error.known);
    sum += error.rel_mse / 20;
    widths += error.half_width / 20;
    plain_widths += estimate(seed, {0, 0, 64, 64}, 1.0, 0.1).half_width / 20;
  }
  EXPECT_NEAR(sum, expected, 0.02 * expected);              // as in FindsAKnownVariance
  EXPECT_NEAR(widths, plain_widths, 0.2 * plain_widths);    // each with a standard deviation of some 3 %
  EXPECT_FALSE(estimate(1, {0, 0, 1, 1}, 1.0, 0.1).known);  // one pixel alone has nothing to compare with
}

// Radiances of 1e25 have squares beyond single precision.
TEST(ErrorEstimate, IsRelativeAtAnyBrightness) {
  const FrameError error = estimate(1, {0, 0, 64, 64}, 1e25, 1e24);
  const double expected = 0.01 / 16;
  EXPECT_NEAR(error.rel_mse, expected, 0.1 * expected);  // a relative standard deviation of 1.3 %
  EXPECT_TRUE(std::isfinite(error.half_width));
}

TEST(ErrorEstimate, UpdatesInStepsGiveTheSameErrorAsOneUpdate) {
  Film film(TileGrid({0, 0, 320, 64}), 3);
  Normal normal(2);
  for (std::uint32_t tile = 0; tile < 5; ++tile) {
    film.merge(TileId{tile}, noisy_node(film, TileId{tile}, 4, 1, 0.1, normal));
  }
  ErrorEstimator exact;
  ErrorEstimator lazy;
  const FrameError at_once = exact.update(film);
  EXPECT_FALSE(lazy.update(film, 2).known);
  EXPECT_FALSE(lazy.update(film, 2).known);
  const FrameError caught_up = lazy.update(film, 2);
  EXPECT_TRUE(caught_up.known);
  EXPECT_EQ(caught_up.rel_mse, at_once.rel_mse);
  EXPECT_EQ(caught_up.half_width, at_once.half_width);
}

}  // namespace
}  // namespace lightmill
