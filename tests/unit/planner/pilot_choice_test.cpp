#include "common/planner/pilot_choice.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace lightmill {
namespace {

const std::vector<std::string> kTwo{"path", "other"};

/// One method's variance and cost, the same on both batches.
PilotMeasure measure(double variance, double cost) {
  return {{variance, variance}, {cost, cost}, {1, 1}, {1e-8, 1e-8}};
}
/// The same measure with the light found on each batch, and the standard deviation of that light.
PilotMeasure with_light(PilotMeasure measure, double first, double second, double deviation = 1e-4) {
  measure.light = {first, second};
  measure.light_variance = {deviation * deviation, deviation * deviation};
  return measure;
}
std::size_t choice(std::vector<PilotMeasure> measures) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < measures.size(); ++i) {
    names.push_back(i == 0 ? "path" : fmt::format("m{}", i));
  }
  return choose(names, measures).choice;
}

TEST(PilotChoice, VarianceTimesCostDecides) {
  EXPECT_EQ(choice({measure(1, 1)}), 0u);
  EXPECT_EQ(choice({measure(1, 1), measure(0.5, 1)}), 1u);
  EXPECT_EQ(choice({measure(1, 1), measure(0.5, 2)}), 0u);
  EXPECT_EQ(choice({measure(1, 1), measure(1, 0.5)}), 1u);
  EXPECT_EQ(choice({measure(1, 1), measure(0.5, 1), measure(0.4, 1)}), 2u);
}

TEST(PilotChoice, OnlyAClearGainOnBothBatchesReplacesTheSimplest) {
  EXPECT_EQ(choice({measure(1, 1), measure(1 / (kClearGain * 0.99), 1)}), 0u);
  EXPECT_EQ(choice({measure(1, 1), measure(1 / (kClearGain * 1.01), 1)}), 1u);
  EXPECT_EQ(choice({measure(1, 1), {{0.01, 0.9}, {1, 1}, {1, 1}, {}}}), 0u) << "one batch alone has no voice";
}

TEST(PilotChoice, TheSimplestStaysWithoutNoise) {
  EXPECT_EQ(choice({measure(0, 1), measure(0, 0.1)}), 0u);
  EXPECT_EQ(choice({measure(0, 1), measure(1, 0.1)}), 0u);
  EXPECT_EQ(choice({measure(1, 1), measure(0, 1)}), 1u);
}

TEST(PilotChoice, ReasonsStateTheGain) {
  const PilotChoice made = choose(kTwo, std::vector<PilotMeasure>{measure(1, 1), {{0.25, 0.2}, {1, 1}, {1, 1}, {}}});
  ASSERT_EQ(made.reasons.size(), 1u);
  EXPECT_NE(made.reasons[0].find("for the same error, path needs 4.0 to 5.0 times the work of other"),
            std::string::npos)
      << made.reasons[0];
}

TEST(PilotChoice, ReasonsStateTheLoss) {
  const PilotChoice made = choose(kTwo, std::vector<PilotMeasure>{measure(1, 1), measure(2, 1)});
  EXPECT_EQ(made.reasons, std::vector<std::string>{"for the same error, other needs 2.0 times the work of path"});
}

TEST(PilotChoice, ReasonsExplainAnUnclearGain) {
  const auto reason = [](double first, double second) {
    const PilotMeasure other{{1 / first, 1 / second}, {1, 1}, {1, 1}, {}};
    return choose(kTwo, std::vector<PilotMeasure>{measure(1, 1), other}).reasons.at(0);
  };
  for (const auto& [first, second] : {std::pair(1.19, 1.19), {5.0, 1.19}, {0.5, 3.0}}) {
    EXPECT_NE(reason(first, second).find("a gain must be above 1.2 in both pilots, and path is simpler"),
              std::string::npos)
        << reason(first, second);
  }
  for (const auto& [first, second] : {std::pair(1.21, 5.0), {0.5, 0.99}}) {
    EXPECT_EQ(reason(first, second).find("gain"), std::string::npos) << reason(first, second);
  }
}

TEST(PilotChoice, ReasonsStateNoRatioWithoutNoise) {
  const PilotMeasure half_silent{{0, 1}, {1, 1}, {1, 1}, {}};
  const auto reason = [](const PilotMeasure& path, const PilotMeasure& other) {
    return choose(kTwo, std::vector<PilotMeasure>{path, other}).reasons.at(0);
  };
  EXPECT_EQ(reason(measure(0, 1), measure(0, 1)), "path had no noise in two pilots");
  EXPECT_EQ(reason(measure(0, 1), measure(1, 1)), "path had no noise in two pilots");
  EXPECT_EQ(reason(measure(1, 1), measure(0, 1)), "other had no noise in two pilots");
  EXPECT_EQ(reason(half_silent, measure(1, 1)), "path had no noise in one of two pilots");
  EXPECT_EQ(reason(measure(1, 1), half_silent), "other had no noise in one of two pilots");
}

TEST(PilotChoice, TheLargestInAThousandIsTrimmed) {
  std::vector<double> values(1000, 1.0);
  values[17] = 1e9;
  EXPECT_EQ(trimmed_mean(values), 1);
  std::vector<double> outliers(1000, 1.0);
  outliers[3] = 1e6 + 1;  // one of the two stays
  outliers[4] = 1e9;
  EXPECT_NEAR(trimmed_mean(outliers), 1 + 1e6 / 999, 1e-6);
  std::vector<double> two{3, 5}, one{3}, none;
  EXPECT_EQ(trimmed_mean(two), 3);
  EXPECT_EQ(trimmed_mean(one), 3);
  EXPECT_EQ(trimmed_mean(none), 0);
}

TEST(PilotChoice, AMethodThatMissesLightIsRejectedAtAnyCost) {
  const PilotMeasure dear = measure(100, 1);
  EXPECT_EQ(choice({with_light(measure(1, 1), 0.9, 0.95), dear}), 1u);
  EXPECT_EQ(choice({with_light(measure(1, 1), 0.9, 0.995), dear}), 0u) << "one batch alone has no voice";
  EXPECT_EQ(choice({with_light(measure(1, 1), 0.995, 0.995), dear}), 0u) << "so little does not matter";
  EXPECT_EQ(choice({with_light(measure(1, 1), 0.9, 0.95, 0.02), dear}), 0u) << "it may be chance";
  EXPECT_EQ(choice({dear, with_light(measure(1, 1), 0.9, 0.9)}), 0u);
  EXPECT_EQ(choice({with_light(measure(1, 1), 0.9, 0.9), dear, measure(1, 1)}), 2u) << "the others are compared";
  EXPECT_EQ(choice({with_light(measure(1, 1), 0, 0), dear}), 1u);
}

TEST(PilotChoice, ReasonsStateTheMissedLight) {
  const PilotChoice made = choose(kTwo, std::vector<PilotMeasure>{with_light(measure(1, 1), 0.75, 0.5), measure(1, 1)});
  ASSERT_EQ(made.reasons.size(), 1u);
  EXPECT_NE(made.reasons[0].find("path missed 25% and 50% of the light that other found"), std::string::npos)
      << made.reasons[0];
}

}  // namespace
}  // namespace lightmill
