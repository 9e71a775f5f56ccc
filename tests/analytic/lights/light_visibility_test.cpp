// Estimates of the visibility of groups of lights, by cell.
#include "common/lights/light_visibility.h"
#include "common/sampling/sobol.h"
#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

double estimate(const LightVisibility& visibility, const Vec3& p, std::size_t group) {
  return Lanes(visibility.at(visibility.row(broadcast(p)), group))[3];
}

/// The estimate of a cell with v of n samples.
double within(double around, double v, double n) {
  return (v + 8 * around) / (n + 8);
}

class TwoPlaces : public testing::Test {
 protected:
  TwoPlaces() {
    // Group 0: 10 of 10 samples at x = 0, and 1 of 4 at x = 1. Group 1: none of 10 at x = 0. It was not tested at x = 1.
    std::vector<LightVisibility::Sample> samples(10, {Vec3(0), 0b11, 0b01});
    samples.resize(13, {Vec3(1, 0, 0), 0b01, 0});
    samples.push_back({Vec3(1, 0, 0), 0b01, 0b01});
    visibility_ = LightVisibility(samples, 2);
  }
  LightVisibility visibility_;
  // The cell of all samples. Half of it has the samples of one place, and so have the smaller cells there.
  const double all_[2] = {(11 + 0.5) / 15, 0.5 / 11};
};

TEST_F(TwoPlaces, EachCellStartsFromTheEstimateAroundIt) {
  EXPECT_NEAR(estimate(visibility_, Vec3(0), 0), within(all_[0], 10, 10), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(0), 1), within(all_[1], 0, 10), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(1, 0, 0), 0), within(all_[0], 1, 4), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(1, 0, 0), 1), within(all_[1], 0, 0), 1e-6);
}

TEST_F(TwoPlaces, ACellWithoutSamplesHasTheEstimateAroundIt) {
  // x = 0.3 lies in the half of the first place, but not in its quarter.
  EXPECT_NEAR(estimate(visibility_, Vec3(0.3f, 0, 0), 0), within(all_[0], 10, 10), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(0.3f, 0, 0), 1), within(all_[1], 0, 10), 1e-6);
}

TEST_F(TwoPlaces, PointsOutsideHaveTheNearestCell) {
  for (std::size_t group = 0; group < 2; ++group) {
    EXPECT_EQ(estimate(visibility_, Vec3(7, -3, 9), group), estimate(visibility_, Vec3(1, 0, 0), group));
    EXPECT_EQ(estimate(visibility_, Vec3(-1e30f, 0, 0), group), estimate(visibility_, Vec3(0), group));
  }
}

TEST(LightVisibility, TellsPlacesApartAlongEachAxis) {
  // Groups 0, 1 and 2 are visible where x, y and z are large. The box is 4 by 2 by 1.
  std::vector<LightVisibility::Sample> samples;
  for (int i = 0; i < 20'000; ++i) {
    const auto number = [&](std::uint32_t k) { return (mix(3 * static_cast<std::uint32_t>(i) + k) >> 8) * 0x1p-24f; };
    const Vec3 p(4 * number(0), 2 * number(1), number(2));
    samples.push_back({p, 0b111, (p.x > 2 ? 1u : 0u) | (p.y > 1 ? 2u : 0u) | (p.z > 0.5f ? 4u : 0u)});
  }
  const LightVisibility visibility(samples, 3);
  for (const Vec3& p : {Vec3(1, 1.5f, 0.2f), Vec3(3, 0.5f, 0.8f), Vec3(0.3f, 0.2f, 0.8f), Vec3(3.7f, 1.8f, 0.2f)}) {
    const bool visible[] = {p.x > 2, p.y > 1, p.z > 0.5f};
    for (std::size_t group = 0; group < 3; ++group) {
      EXPECT_NEAR(estimate(visibility, p, group), visible[group] ? 1 : 0, 0.05) << p.x << " " << group;
    }
  }
}

TEST(LightVisibility, FewFarSamplesDoNotWidenTheCells) {
  std::vector<LightVisibility::Sample> samples;
  for (int i = 0; i < 1000; ++i) {
    const float x = static_cast<float>(i) / 1000;
    samples.push_back({Vec3(x, 0, 0), 1, x < 0.5f ? 1u : 0u});
  }
  samples.push_back({Vec3(1e6f, 0, 0), 1, 1});
  const LightVisibility visibility(samples, 1);
  EXPECT_GT(estimate(visibility, Vec3(0.4f, 0, 0), 0), 0.9);
  EXPECT_LT(estimate(visibility, Vec3(0.6f, 0, 0), 0), 0.1);
}

TEST(LightVisibility, IsEmptyWithoutAnExtent) {
  EXPECT_TRUE(LightVisibility({}, 4).empty());
  const std::vector<LightVisibility::Sample> one(5, {Vec3(1, 2, 3), 1, 1});
  EXPECT_TRUE(LightVisibility(one, 4).empty());
}

}  // namespace
}  // namespace lightmill::test
