// FLIP, compared with independently computed values.
//
// The values of patterns come from a separate numpy program. It uses float64, each filter as one two-dimensional
// kernel, and a computed inverse of the colour matrix. The difference is rounding to float32 here. Features are the
// root of a difference, so 1e-7 becomes 3e-4 in an exponent. The tolerance is 1e-4.
#include "common/image/flip.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill {
namespace {

RgbImage uniform(float red, float green, float blue) {
  RgbImage image{12, 9, {}};
  for (const float value : {red, green, blue}) {
    image.values.insert(image.values.end(), image.pixels(), value);
  }
  return image;
}

/// ((7x + 13y + 5c + shift) mod 11)/16 + ⌊x/8⌋/8, times `scale`(x); `shift` is (x + y) mod 3 in the test picture.
RgbImage pattern(bool test, const std::function<float(int)>& scale) {
  RgbImage image{24, 18, {}};
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const int number = (7 * x + 13 * y + 5 * c + (test ? (x + y) % 3 : 0)) % 11;
        const float value = static_cast<float>(number) / 16.0f + static_cast<float>(x / 8) / 8.0f;
        image.values.push_back(value * scale(x));
      }
    }
  }
  return image;
}

double between(const RgbImage& picture, const RgbImage& reference) {
  return mean_flip(flip_map(picture, reference).value());
}

constexpr double kTolerance = 1e-4;

TEST(Flip, UniformColoursHitTheColourMetric) {
  // Blurring does not change uniform colours, and they have no features. The redistributed HyAB distance of
  // Hunt-adjusted CIELAB remains. From black to white it is 100, and 100^0.7 lies beyond the knee of 0.4 · 41.2761.
  EXPECT_NEAR(between(uniform(0, 0, 0), uniform(1, 1, 1)),
              0.95 + 0.05 * (std::pow(100.0, 0.7) - 0.4 * 41.2760984) / (0.6 * 41.2760984), kTolerance);
  EXPECT_NEAR(between(uniform(0, 1, 0), uniform(0, 0, 1)), 1, kTolerance);  // the scale is normalised by this
  EXPECT_NEAR(between(uniform(0.5f, 0.5f, 0.5f), uniform(0.25f, 0.25f, 0.25f)), 0.4518496, kTolerance);
  EXPECT_NEAR(between(uniform(1, 0, 0), uniform(0.5f, 0.1f, 0.2f)), 0.8100855, kTolerance);
  EXPECT_EQ(between(uniform(0.3f, 0.2f, 0.7f), uniform(0.3f, 0.2f, 0.7f)), 0);
  EXPECT_EQ(between(uniform(2, -1, 7), uniform(1, 0, 1)), 0);  // a screen shows no difference
}

TEST(Flip, PatternsHaveTheValuesOfTheFormulas) {
  const auto plain = [](int) { return 1.0f; };
  const RgbImage picture = pattern(true, plain), reference = pattern(false, plain);
  const std::vector<float> map = flip_map(picture, reference).value();
  EXPECT_NEAR(mean_flip(map), 0.2454295, kTolerance);
  EXPECT_NEAR(map[0], 0.1907135, kTolerance);
  EXPECT_NEAR(map[9 * 24 + 11], 0.2432766, kTolerance);
  EXPECT_NEAR(map[17 * 24 + 23], 0.2056899, kTolerance);
  const std::vector<float> from_afar = flip_map(picture, reference, 20).value();
  EXPECT_NEAR(mean_flip(from_afar), 0.4069033, kTolerance);
  EXPECT_NEAR(from_afar[9 * 24 + 11], 0.3650521, kTolerance);
  EXPECT_EQ(flip_map(reference, picture).value(), map);  // it is symmetric
}

TEST(Flip, HdrTakesTheWorstOfItsExposures) {
  const auto scale = [](int x) { return std::exp2(static_cast<float>(x / 6) * 2.0f - 3.0f); };
  const std::vector<float> map = hdr_flip_map(pattern(true, scale), pattern(false, scale)).value();
  EXPECT_NEAR(mean_flip(map), 0.1988500, kTolerance);
  EXPECT_NEAR(map[9 * 24 + 11], 0.2006224, kTolerance);
  EXPECT_NEAR(map[17 * 24 + 23], 0.0901522, kTolerance);
  // Exposures follow the reference, so a scale common to both pictures has no effect.
  const auto brighter = [&](int x) { return 1024 * scale(x); };
  const std::vector<float> scaled = hdr_flip_map(pattern(true, brighter), pattern(false, brighter)).value();
  EXPECT_NEAR(mean_flip(scaled), mean_flip(map), kTolerance);
}

TEST(Flip, HdrComparesMostlyBlackAndDarkPictures) {
  RgbImage reference = uniform(0, 0, 0);
  EXPECT_EQ(mean_flip(hdr_flip_map(reference, reference).value()), 0);
  EXPECT_GT(mean_flip(hdr_flip_map(uniform(1, 1, 1), reference).value()), 0.9);
  reference.values[7] = 1e-3f;  // one pixel: the median is black
  EXPECT_EQ(mean_flip(hdr_flip_map(reference, reference).value()), 0);
  EXPECT_GT(mean_flip(hdr_flip_map(uniform(0, 0, 0), reference).value()), 0);
}

TEST(Flip, IncomparablePicturesAreRefused) {
  RgbImage broken = uniform(1, 1, 1);
  broken.values[14] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(flip_map(broken, uniform(1, 1, 1)).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(hdr_flip_map(uniform(1, 1, 1), broken).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(flip_map(pattern(true, [](int) { return 1.0f; }), broken).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace lightmill
