// Estimates of the visibility of groups of lights, by cell.
#include "common/lights/light_visibility.h"
#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

double estimate(const LightVisibility& visibility, const Vec3& p, std::size_t group) {
  return Lanes(visibility.at(visibility.row(broadcast(p)), group))[3];
}

/// The estimate after this number of further cells, which have v of n samples, around each other.
double nested(double around, double v, double n, int cells) {
  for (int i = 0; i < cells; ++i) {
    around = (v + around) / (n + 1);
  }
  return around;
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
  // The cell of all samples, and five cells of half the length around each place.
  const double all_[2] = {(11 + 0.5) / 15, 0.5 / 11};
};

TEST_F(TwoPlaces, EachCellStartsFromTheEstimateAroundIt) {
  EXPECT_NEAR(estimate(visibility_, Vec3(0), 0), nested(all_[0], 10, 10, 5), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(0), 1), nested(all_[1], 0, 10, 5), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(1, 0, 0), 0), nested(all_[0], 1, 4, 5), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(1, 0, 0), 1), all_[1], 1e-6);
}

TEST_F(TwoPlaces, ACellWithoutSamplesHasTheEstimateAroundIt) {
  // x = 0.3 lies in the half of the first place, but not in its quarter.
  EXPECT_NEAR(estimate(visibility_, Vec3(0.3f, 0, 0), 0), nested(all_[0], 10, 10, 1), 1e-6);
  EXPECT_NEAR(estimate(visibility_, Vec3(0.3f, 0, 0), 1), nested(all_[1], 0, 10, 1), 1e-6);
}

TEST_F(TwoPlaces, PointsOutsideHaveTheNearestCell) {
  for (std::size_t group = 0; group < 2; ++group) {
    EXPECT_EQ(estimate(visibility_, Vec3(7, -3, 9), group), estimate(visibility_, Vec3(1, 0, 0), group));
    EXPECT_EQ(estimate(visibility_, Vec3(-1e30f, 0, 0), group), estimate(visibility_, Vec3(0), group));
  }
}

TEST(LightVisibility, IsEmptyWithoutAnExtent) {
  EXPECT_TRUE(LightVisibility({}, 4).empty());
  const std::vector<LightVisibility::Sample> one(5, {Vec3(1, 2, 3), 1, 1});
  EXPECT_TRUE(LightVisibility(one, 4).empty());
}

}  // namespace
}  // namespace lightmill::test
