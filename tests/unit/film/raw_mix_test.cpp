#include "common/film/raw_mix.h"

#include <gtest/gtest.h>

#include <random>

namespace lightmill {
namespace {

constexpr int kSide = 96;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide, kFeatureValues = std::size_t{20} * kPixels;

/// A picture, noisy halves of it, and features that say nothing about it.
struct NoisyFilm {
  std::vector<float> truth = std::vector<float>(3 * kPixels), half_a = truth, half_b = truth;
  std::vector<float> features = std::vector<float>(kFeatureValues, 0.1f);
  std::vector<std::uint32_t> samples_a = std::vector<std::uint32_t>(kPixels, 8), samples_b = samples_a;

  /// `detail`: standard deviation of the picture from pixel to pixel. `noise`: that of a half.
  NoisyFilm(double detail, double noise, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double value = 2 + detail * normal(random);
      truth[i] = static_cast<float>(value);
      half_a[i] = static_cast<float>(value + noise * normal(random));
      half_b[i] = static_cast<float>(value + noise * normal(random));
    }
  }
  ReconstructionInput input() const { return {kSide, kSide, half_a, half_b, samples_a, samples_b, features}; }
  std::vector<float> mean() const {
    std::vector<float> out(truth.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = (half_a[i] + half_b[i]) / 2;
    }
    return out;
  }
  /// Mean squared error.
  double error_of(const std::vector<float>& picture) const {
    double sum = 0;
    for (std::size_t i = 0; i < picture.size(); ++i) {
      const double off = static_cast<double>(picture[i]) - static_cast<double>(truth[i]);
      sum += off * off;
    }
    return sum / static_cast<double>(picture.size());
  }
};

TEST(RawMix, HasTheLeastErrorOfAllMixes) {
  for (const double ratio : {0.2, 1.0, 5.0}) {
    const double noise = 0.1;
    const NoisyFilm film(0.3, noise, 3);
    // A reconstruction whose error is independent of the noise.
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    std::vector<float> picture = film.truth;
    for (float& value : picture) {
      value += static_cast<float>(ratio * noise * normal(random));
    }
    const double variance = noise * noise / 2, error = ratio * ratio * noise * noise;
    EXPECT_NEAR(film.error_of(film.mean()), variance, 0.02 * variance);
    mix_with_raw(film.input(), 2, picture);
    const double least = variance * error / (variance + error);
    EXPECT_NEAR(film.error_of(picture), least, 0.04 * least) << ratio;
  }
}

TEST(RawMix, MakesNoPictureWorseThanTheRawOne) {
  for (const double detail : {0.0, 0.02, 0.05, 0.1, 0.2, 0.5}) {
    const NoisyFilm film(detail, 0.1, 5);
    const double raw = film.error_of(film.mean()), regressed = film.error_of(regress(film.input())),
                 mixed = film.error_of(reconstruct(film.input()));
    EXPECT_LE(mixed, 1.02 * raw) << detail;
    EXPECT_LE(mixed, 1.02 * regressed + 1e-3 * raw) << detail;
  }
  // Where detail and noise are alike, the regression blurs more than it gains.
  const NoisyFilm film(0.1, 0.1, 5);
  EXPECT_GT(film.error_of(regress(film.input())), 1.2 * film.error_of(film.mean()));
}

TEST(RawMix, AFireflyChangesOnlyItsSurroundings) {
  NoisyFilm film(0.1, 0.1, 8);
  const std::vector<float> before = reconstruct(film.input());
  const std::size_t spike = 20 * kSide + 20;
  film.half_a[spike] = 1e11f;
  std::vector<float> regressed = regress(NoisyFilm(0.1, 0.1, 8).input());
  mix_with_raw(film.input(), 2, regressed);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const std::size_t x = i % kSide, y = i / kSide % kSide;
    if (x > 20 + 40 || y > 20 + 40) {
      ASSERT_NEAR(regressed[i], before[i], 1e-4) << x << "," << y;
    }
  }
}

TEST(RawMix, LeavesPixelsThatItDoesNotKnow) {
  NoisyFilm film(0, 0.1, 6);
  film.samples_b[17] = 0;
  film.half_a[18] = std::numeric_limits<float>::infinity();
  std::vector<float> picture(3 * kPixels, 2.0f);
  picture[17] = 5;
  picture[18] = 7;
  mix_with_raw(film.input(), 2, picture);
  EXPECT_EQ(picture[17], 5);
  EXPECT_EQ(picture[18], 7);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    ASSERT_TRUE(std::isfinite(picture[i])) << i;
  }
}

}  // namespace
}  // namespace lightmill
