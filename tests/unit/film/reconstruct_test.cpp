#include "common/film/reconstruct.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace lightmill {
namespace {

constexpr std::size_t kFeatures = 7, kHalfPlanes = 10;  // albedo, normal, 1/depth; with the squares
constexpr float kAlike = 1e6f;                          // a tolerance that gives all pixels of a window weight 1

/// A film of 16 samples whose features have no noise.
struct TestFilm {
  int width, height;
  std::size_t pixels;
  std::vector<float> half_a, half_b, features;
  std::vector<std::uint32_t> samples_a, samples_b;

  TestFilm(int width_in, int height_in)
      : width(width_in),
        height(height_in),
        pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        half_a(3 * pixels),
        half_b(3 * pixels),
        features(2 * kHalfPlanes * pixels),
        samples_a(pixels, 8),
        samples_b(pixels, 8) {}
  void set_feature(std::size_t feature, std::size_t pixel, float value) {
    for (std::size_t half = 0; half < 2; ++half) {
      features[(half * kHalfPlanes + feature) * pixels + pixel] = value / 2;
      features[(half * kHalfPlanes + kFeatures + feature / 3) * pixels + pixel] += value * value / 2;
    }
  }
  float feature(std::size_t feature, std::size_t pixel) const { return 2 * features[feature * pixels + pixel]; }
  void set_color(std::size_t channel, std::size_t pixel, float a, float b) {
    half_a[channel * pixels + pixel] = a;
    half_b[channel * pixels + pixel] = b;
  }
  ReconstructionInput input() const { return {width, height, half_a, half_b, samples_a, samples_b, features}; }
  std::vector<float> reconstructed(const ReconstructionSettings& settings = {}) const {
    return reconstruct(input(), settings);
  }
};

/// Waves of different lengths as features, within [−1, 1]; 1/depth is around 1.
TestFilm wavy_film(int width, int height) {
  TestFilm film(width, height);
  for (std::size_t i = 0; i < film.pixels; ++i) {
    const auto x = static_cast<double>(i % static_cast<std::size_t>(width)),
               y = static_cast<double>(i / static_cast<std::size_t>(width));
    for (std::size_t f = 0; f < kFeatures; ++f) {
      const double wave = std::sin((0.5 + 0.13 * static_cast<double>(f)) * x + static_cast<double>(f)) *
                          std::cos((0.9 - 0.11 * static_cast<double>(f)) * y);
      film.set_feature(f, i, static_cast<float>(f == 6 ? 1 + 0.3 * wave : wave));
    }
  }
  return film;
}

/// An affine function of the features, for each channel.
double affine(const TestFilm& film, std::size_t channel, std::size_t pixel) {
  double value = 3 + static_cast<double>(channel);
  for (std::size_t f = 0; f < kFeatures; ++f) {
    value += (0.1 * static_cast<double>(f) - 0.25 + 0.07 * static_cast<double>(channel)) *
             static_cast<double>(film.feature(f, pixel));
  }
  return value;
}

/// Sets the picture to the affine function plus noise with this standard deviation in each half.
void add_noise(TestFilm& film, double deviation, std::mt19937& random) {
  std::normal_distribution<double> normal(0, deviation);  // its bits do not matter here
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < film.pixels; ++i) {
      const double value = affine(film, channel, i);
      film.set_color(channel, i, static_cast<float>(value + normal(random)),
                     static_cast<float>(value + normal(random)));
    }
  }
}

TEST(Reconstruction, AnAffineFunctionOfTheFeaturesIsReproduced) {
  TestFilm film = wavy_film(50, 37);
  std::mt19937 random(1);
  add_noise(film, 0, random);
  for (const float tolerance : {0.5f, kAlike}) {
    const std::vector<float> picture = film.reconstructed({.tolerance = tolerance});
    for (std::size_t i = 0; i < picture.size(); ++i) {
      // The picture spreads by more than 1. The ridge of 0.002 shrinks slopes by some percent of this.
      ASSERT_NEAR(picture[i], affine(film, i / film.pixels, i % film.pixels), 0.05) << i;
    }
  }
}

/// The inverse of a positive definite matrix, by Gauss-Jordan elimination.
std::vector<std::vector<double>> inverse(std::vector<std::vector<double>> a) {
  const std::size_t n = a.size();
  std::vector<std::vector<double>> out(n, std::vector<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    out[i][i] = 1;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double pivot = a[i][i];
    for (std::size_t k = 0; k < n; ++k) {
      a[i][k] /= pivot;
      out[i][k] /= pivot;
    }
    for (std::size_t j = 0; j < n; ++j) {
      const double factor = j == i ? 0 : a[j][i];
      for (std::size_t k = 0; k < n; ++k) {
        a[j][k] -= factor * a[i][k];
        out[j][k] -= factor * out[i][k];
      }
    }
  }
  return out;
}

/// Rows of the linear operator that the reconstruction becomes when all weights are 1. It is ridge regression in
/// windows of 15×15 pixels around every second pixel. The result is the mean of the windows' predictions, with 0.3 of
/// the pixel itself. The operator counts both halves, as each of them has a model in each window.
std::vector<std::vector<double>> regression_operator(const TestFilm& film) {
  const auto width = static_cast<std::size_t>(film.width);
  std::vector<std::vector<double>> rows(film.pixels, std::vector<double>(film.pixels));
  std::vector<double> windows(film.pixels);
  for (int cy = 0; cy < film.height; cy += 2) {
    for (int cx = 0; cx < film.width; cx += 2) {
      const std::size_t center = static_cast<std::size_t>(cy) * width + static_cast<std::size_t>(cx);
      std::vector<std::size_t> inside;
      std::vector<std::vector<double>> z;
      for (int y = std::max(cy - 7, 0); y <= std::min(cy + 7, film.height - 1); ++y) {
        for (int x = std::max(cx - 7, 0); x <= std::min(cx + 7, film.width - 1); ++x) {
          inside.push_back(static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x));
          z.emplace_back(std::vector<double>{1});
          for (std::size_t f = 0; f < kFeatures; ++f) {
            const double scale = f == 6 ? 4 / static_cast<double>(film.feature(6, center)) : 1;
            z.back().push_back(
                (static_cast<double>(film.feature(f, inside.back())) - static_cast<double>(film.feature(f, center))) *
                scale);
          }
        }
      }
      std::vector<std::vector<double>> normal(8, std::vector<double>(8));
      for (std::size_t i = 0; i < 8; ++i) {
        for (std::size_t j = 0; j < 8; ++j) {
          for (const auto& terms : z) {
            normal[i][j] += terms[i] * terms[j];
          }
        }
        normal[i][i] += i == 0 ? 0 : 0.002 * static_cast<double>(inside.size());
      }
      const auto solution = inverse(normal);
      for (std::size_t q = 0; q < inside.size(); ++q) {
        windows[inside[q]] += 2;
        std::array<double, 8> model{};
        for (std::size_t i = 0; i < 8; ++i) {
          for (std::size_t j = 0; j < 8; ++j) {
            model[i] += z[q][j] * solution[j][i];
          }
        }
        for (std::size_t s = 0; s < inside.size(); ++s) {
          rows[inside[q]][inside[s]] += 2 * std::inner_product(model.begin(), model.end(), z[s].begin(), 0.0);
        }
      }
    }
  }
  for (std::size_t q = 0; q < film.pixels; ++q) {
    rows[q][q] += 0.3;
    for (double& value : rows[q]) {
      value /= windows[q] + 0.3;
    }
  }
  return rows;
}

TEST(Reconstruction, EqualWeightsGiveTheVarianceOfLeastSquares) {
  TestFilm film = wavy_film(26, 19);
  const auto rows = regression_operator(film);
  std::mt19937 random(2);
  constexpr double kDeviation = 0.2;
  constexpr int kFilms = 20;
  double squares = 0, expected = 0;
  for (int n = 0; n < kFilms; ++n) {
    add_noise(film, kDeviation, random);
    const std::vector<float> picture = regress(film.input(), {.tolerance = kAlike});
    for (std::size_t channel = 0; channel < 3; ++channel) {
      for (std::size_t q = 0; q < film.pixels; ++q) {
        double exact = 0, truth = 0, variance = 0;
        for (std::size_t s = 0; s < film.pixels; ++s) {
          const std::size_t at = channel * film.pixels + s;
          exact += rows[q][s] * (static_cast<double>(film.half_a[at]) + static_cast<double>(film.half_b[at])) / 2;
          truth += rows[q][s] * affine(film, channel, s);
          variance += rows[q][s] * rows[q][s] * kDeviation * kDeviation / 2;
        }
        const double value = picture[channel * film.pixels + q];
        ASSERT_NEAR(value, exact, 1e-3);
        squares += (value - truth) * (value - truth);
        expected += variance;
      }
    }
  }
  // 60 planes with at least the 8 degrees of freedom of one window: 0.26 is four standard deviations of √(2 / 480).
  EXPECT_NEAR(squares / expected, 1, 0.26);
}

TEST(Reconstruction, AConstantPictureStaysAndItsNoiseShrinks) {
  TestFilm film(70, 41);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < film.pixels; ++i) {
      film.set_color(channel, i, 0.7f, 0.7f);
    }
  }
  for (const float value : film.reconstructed()) {
    ASSERT_NEAR(value, 0.7f, 1e-5f);
  }
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0.7f, 0.1f);
  for (std::size_t i = 0; i < film.half_a.size(); ++i) {
    film.half_a[i] = normal(random);
    film.half_b[i] = normal(random);
  }
  double squares = 0;
  for (const float value : film.reconstructed()) {
    squares += (static_cast<double>(value) - 0.7) * (static_cast<double>(value) - 0.7);
  }
  // The raw picture has the variance 0.005. A mean over 225 pixels would have 0.000022.
  EXPECT_LT(squares / static_cast<double>(3 * film.pixels), 0.005 / 20);
}

TEST(Reconstruction, EdgesOfTheFeaturesStaySharp) {
  TestFilm film(64, 64);
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 0.15f);
  const auto is_right = [](std::size_t i) { return i % 64 >= 31; };
  for (std::size_t i = 0; i < film.pixels; ++i) {
    film.set_feature(3, i, is_right(i) ? 1.0f : 0.0f);
    film.set_feature(5, i, is_right(i) ? 0.0f : 1.0f);
    film.set_feature(6, i, 0.25f);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const float value = is_right(i) ? 0.6f : 0.9f;
      film.set_color(channel, i, value + noise(random), value + noise(random));
    }
  }
  const std::vector<float> picture = film.reconstructed();
  for (const std::size_t column : {29u, 30u, 31u, 32u}) {
    double mean = 0;
    for (std::size_t row = 0; row < 64; ++row) {
      mean += static_cast<double>(picture[row * 64 + column]) / 64;
    }
    EXPECT_NEAR(mean, is_right(column) ? 0.6 : 0.9, 0.03) << column;
  }
}

TEST(Reconstruction, ThreadsDoNotChangeTheBits) {
  TestFilm film = wavy_film(75, 90);
  std::mt19937 random(5);
  add_noise(film, 0.3, random);
  const std::vector<float> one = film.reconstructed();
  for (const int threads : {2, 3, 16}) {
    EXPECT_EQ(film.reconstructed({.threads = threads}), one) << threads;
  }
}

TEST(Reconstruction, ABrighterPictureGivesTheSamePictureBrighter) {
  TestFilm film = wavy_film(40, 20);
  std::mt19937 random(6);
  add_noise(film, 0.3, random);
  std::vector<float> expected = film.reconstructed();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    film.half_a[i] *= 1024;
    film.half_b[i] *= 1024;
    expected[i] *= 1024;
  }
  EXPECT_EQ(film.reconstructed(), expected);
}

TEST(Reconstruction, PixelsWithoutSoundValuesAreLeftOut) {
  TestFilm film = wavy_film(40, 33);
  std::mt19937 random(7);
  add_noise(film, 0.3, random);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  const std::size_t nan = 5 * 40 + 8, infinite = 9 * 40 + 21, feature = 20 * 40 + 3, empty = 14 * 40 + 30;
  film.half_a[nan] = kNan;
  film.half_b[film.pixels + infinite] = kInf;
  film.features[3 * film.pixels + feature] = -kInf;
  film.samples_b[empty] = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    film.half_b[channel * film.pixels + empty] = 0;
  }
  const std::vector<float> picture = film.reconstructed();
  EXPECT_TRUE(std::ranges::all_of(picture, [](float value) { return std::isfinite(value) && value >= 0; }));
  EXPECT_EQ(picture[nan], 0);
  EXPECT_EQ(picture[film.pixels + infinite], 0);
  EXPECT_EQ(picture[empty], film.half_a[empty]);
  EXPECT_EQ(picture[feature], (film.half_a[feature] + film.half_b[feature]) / 2);
  // Other values in these pixels change nothing elsewhere.
  for (const std::size_t pixel : {nan, infinite, feature}) {
    film.half_b[2 * film.pixels + pixel] = kNan;
    film.features[pixel] = 1e20f;
  }
  film.half_a[empty] = 1e9f;
  std::vector<float> other = film.reconstructed();
  for (const std::size_t pixel : {nan, infinite, feature, empty}) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      other[channel * film.pixels + pixel] = picture[channel * film.pixels + pixel];
    }
  }
  EXPECT_EQ(other, picture);
}

TEST(Reconstruction, APictureWithoutAnySamplesIsBlack) {
  TestFilm film(3, 1);
  film.samples_a = film.samples_b = {0, 0, 0};
  EXPECT_EQ(film.reconstructed(), std::vector<float>(9));
}

}  // namespace
}  // namespace lightmill
