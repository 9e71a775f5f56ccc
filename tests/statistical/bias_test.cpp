// Compares the stated error of pictures that gathering blurs with their true error.
#include <gtest/gtest.h>

#include "common/film/error_estimate.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

constexpr int kSide = 32;
constexpr std::uint32_t kPixels = kSide * kSide;

/// Sums of beauty and bias over samples [0, 2^level), as in films.
struct Sums {
  std::vector<float> beauty, bias;
  std::uint64_t samples = 0;
};
Sums sums_of(const TestScene& scene, const std::string& method_text, std::uint64_t seed, std::uint32_t level) {
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets(), nullptr);
  const std::vector<LayerSpec> layers = *film_layers(std::vector<std::string>{std::string(kBiasLayer)});
  const auto method = make_method(*compiled, {method_text, seed, 0, layers});
  EXPECT_TRUE(method.ok()) << method.status();
  const auto workspace = (*method)->make_workspace();
  const Node node = (*method)->render({0, 0, kSide, kSide}, {level, 0}, *workspace);
  const NodeLayout layout(layers);
  Sums sums{{}, {}, std::uint64_t{1} << level};
  for (std::size_t half = 0; half < 2; ++half) {
    const float* const planes = node.values.data() + half * layout.summed * kPixels;
    sums.beauty.insert(sums.beauty.end(), planes, planes + 3 * kPixels);
    sums.bias.insert(sums.bias.end(), planes + layout.bias * kPixels, planes + (layout.bias + 3) * kPixels);
  }
  return sums;
}

double value(const Sums& sums, std::size_t i) {
  return (static_cast<double>(sums.beauty[i]) + sums.beauty[i + 3 * kPixels]) / static_cast<double>(sums.samples);
}

double true_error(const Sums& picture, const Sums& reference) {
  double sum = 0;
  for (std::size_t i = 0; i < 3 * kPixels; ++i) {
    const double r = value(reference, i), difference = value(picture, i) - r;
    sum += difference * difference / (r * r + 0.01);
  }
  return sum / (3 * kPixels);
}

double stated_error(const Sums& picture, bool with_bias) {
  const Film::HalfCounts counts{picture.samples / 2, picture.samples / 2};
  return estimate_tile_error(picture.beauty, kSide, kSide, 3, counts,
                             with_bias ? std::span<const float>(picture.bias) : std::span<const float>())
             .sum /
         (3 * kPixels);
}

/// A glass ball and a point light over a floor, seen in a mirror. All light of photons is gathered.
TestScene caustic_in_a_mirror() {
  return TestScene::from_text(document(R"("eye": [0, 1.2, 0], "look_at": [0, 0.2, -2])", 50, kSide,
                                       diffuse("floor", 0.7) + also(named("glass", R"("dielectric": {"ior": 1.5})")) +
                                           also(named("mirror", R"("mirror": {})")),
                                       plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") +
                                           also(plane_shape("mirror", "[0, 0, -2]", "[0, 0, 1]")) +
                                           also(sphere("glass", "[0, 0.7, 0.6]", 0.4)),
                                       R"({"point": {"position": [0.5, 3, 0.9], "intensity": {"rgb": [9, 9, 9]}}})"));
}

struct Gathers {
  const char* method;
  std::uint32_t reference_level;  ///< log2 of the samples of the reference

  friend void PrintTo(const Gathers& gathers, std::ostream* out) { *out << gathers.method; }
};

class GatherBiasByMethod : public ::testing::TestWithParam<Gathers> {};

TEST_P(GatherBiasByMethod, IsStatedWithTheError) {
  const TestScene scene = caustic_in_a_mirror();
  const Sums reference = sums_of(scene, "caustic:photons=20000,radius=0.4", 1, GetParam().reference_level);
  const double noise = stated_error(reference, true);
  for (const double radius : {3.0, 6.0}) {
    const Sums picture = sums_of(scene, fmt::format("{}:photons=10000,radius={}", GetParam().method, radius), 2, 9);
    const double truth = true_error(picture, reference);
    ASSERT_LT(noise, 0.25 * truth) << "the noise hides a difference";
    EXPECT_LT(stated_error(picture, false), 0.5 * truth) << radius;
    // The stated bias is scaled for edges. Within patches of light it is two and a half times too large.
    EXPECT_GT(stated_error(picture, true), 0.75 * truth) << radius;
    EXPECT_LT(stated_error(picture, true), 2.5 * truth) << radius;
  }
}

INSTANTIATE_TEST_SUITE_P(By, GatherBiasByMethod, ::testing::Values(Gathers{"caustic", 9}, Gathers{"vcm", 10}),
                         [](const auto& info) { return std::string(info.param.method); });

TEST(GatherBias, IsZeroWithoutGathers) {
  const TestScene scene =
      TestScene::from_text(document(R"("eye": [0, 1, 3], "look_at": [0, 0, 0])", 50, kSide, diffuse("floor", 0.7),
                                    plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]"),
                                    R"({"point": {"position": [0, 2, 0], "intensity": {"rgb": [9, 9, 9]}}})"));
  for (const std::string method : {"path", "caustic"}) {
    const Sums picture = sums_of(scene, method, 1, 4);
    EXPECT_GT(value(picture, kPixels / 2), 0);
    EXPECT_EQ(picture.bias, std::vector<float>(picture.bias.size(), 0.0f));
  }
}

}  // namespace
}  // namespace lightmill::test
