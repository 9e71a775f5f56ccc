// Both bench boxes against stored references of the scalar reference tracer (references/, made by make_reference).
//
// The test compares 768 block means per box. For normal errors a |z| above 6 anywhere is a false alarm once in 650,000
// runs. A mean square of z above 1.35 (expected 1 ± 0.051) is one once in 10^10. The seeds are fixed, so a run that
// passes stays so.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/block_means.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

struct Comparison {
  double largest_z = 0;
  double mean_square_z = 0;
};

Comparison compare(const BlockMeans& a, const BlockMeans& b) {
  EXPECT_EQ(a.size(), b.size());
  Comparison result;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double z = (a[i].value - b[i].value) / std::hypot(a[i].standard_error, b[i].standard_error);
    result.largest_z = std::max(result.largest_z, std::abs(z));
    result.mean_square_z += z * z / static_cast<double>(a.size());
  }
  return result;
}

BlockMeans render(const TestScene& scene, std::uint32_t max_bounces, std::uint32_t level) {
  std::vector<std::vector<double>> images;
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    const HalfImages halves = scene.render({"path", 100 + seed, max_bounces}, level);
    auto& image = images.emplace_back(halves.a.size());
    for (std::size_t i = 0; i < image.size(); ++i) {
      image[i] = halves.mean(i);
    }
  }
  return block_means(images);
}

TestScene box(const std::string& name) {
  return TestScene(source_file("scenes/" + name + ".json")).resized(kTestFilm, kTestFilm);
}
BlockMeans reference(const std::string& name) {
  return read_block_means(source_file("tests/statistical/references/" + name + ".txt"));
}

class Boxes : public ::testing::TestWithParam<std::string> {};

TEST_P(Boxes, AgreeWithTheReferenceTracer) {
  const Comparison c = compare(render(box(GetParam()), 0, 5), reference(GetParam()));
  EXPECT_LT(c.largest_z, 6);
  EXPECT_LT(c.mean_square_z, 1.35);
}

TEST_P(Boxes, TheTestSeesASingleMissingBounce) {
  const Comparison c = compare(render(box(GetParam()), 5, 5), reference(GetParam()));
  EXPECT_GT(c.mean_square_z, 2);
}

INSTANTIATE_TEST_SUITE_P(Bench, Boxes, ::testing::Values("cornell-bench-blocks", "cornell-bench-balls"),
                         [](const auto& info) { return info.param.substr(info.param.rfind('-') + 1); });

// (A−B)²/4 is an unbiased estimate of the variance of the mean, also with low-discrepancy points.
TEST(HalfVariance, IsTheVarianceOverSeedsWithinFivePercent) {
  const TestScene scene = TestScene(source_file("scenes/cornell-bench-blocks.json")).resized(64, 64);
  const PixelRect rect{20, 24, 16, 16};
  constexpr int kSeeds = 200;
  for (const std::uint32_t level : {3u, 6u}) {
    std::vector<double> sum, squares;
    double estimated = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const HalfImages image = scene.render({"path", 5000 + seed, 0}, level, rect);
      sum.resize(image.a.size());
      squares.resize(image.a.size());
      for (std::size_t i = 0; i < sum.size(); ++i) {
        sum[i] += image.mean(i);
        squares[i] += image.mean(i) * image.mean(i);
        estimated += image.variance(i) / kSeeds;
      }
    }
    double observed = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      observed += (squares[i] - sum[i] * sum[i] / kSeeds) / (kSeeds - 1);
    }
    // 256 pixels × 200 seeds: both have a relative standard deviation below 1.4 %.
    EXPECT_NEAR(estimated / observed, 1, 0.05) << (1 << level) << " samples";
  }
}

}  // namespace
}  // namespace lightmill::test
