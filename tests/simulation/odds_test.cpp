// Tests of the odds that audits find a liar.
#include "tests/simulation/odds.h"

#include <gtest/gtest.h>

namespace lightmill::simulation {
namespace {

// Four standard errors: a false alarm in one of 16,000 rows. The seeds are fixed.
TEST(Odds, MatchTheTheory) {
  const OddsTable table = measure_odds(4);
  fmt::print("{}", table.text());
  EXPECT_LT(table.worst(), 4);
}

TEST(Odds, RevealACoordinatorThatAuditsHalfOfTheShare) {
  PlantedBugs bugs;
  bugs.audit_less = true;
  EXPECT_GT(measure_odds(2, bugs).worst(), 4);
}

TEST(Odds, RevealACoordinatorThatSeesNoDifference) {
  PlantedBugs bugs;
  bugs.repeat_results = true;
  EXPECT_GT(measure_odds(1, bugs).worst(), 4);
}

/// The table of docs/design/audits.md: the numbers of results after which half, 95 % and 99.9 % of the liars are found.
TEST(Odds, MatchTheDocumentedTable) {
  struct Line {
    double share, wrong;
    double results[3];
  };
  constexpr double kFound[] = {0.5, 0.95, 0.999};
  for (const auto& [share, wrong, results] :
       {Line{0.01, 1, {69, 299, 688}}, Line{0.1, 1, {7, 29, 66}}, Line{0.01, 0.01, {6932, 29956, 69075}},
        Line{0.1, 0.01, {693, 2995, 6905}}, Line{1, 0.01, {69, 299, 688}}}) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_GE(odds_of_detection(share, {.parts = results[i], .wrong = wrong}, 1), kFound[i]);
      EXPECT_LT(odds_of_detection(share, {.parts = results[i] - 1, .wrong = wrong}, 1), kFound[i]);
    }
  }
  // A tenth of a job, and a whole one: 100 and 1000 parts, in results of any size.
  EXPECT_NEAR(odds_of_detection(0.01, {.parts = 100}, 1), 0.63, 0.005);
  EXPECT_NEAR(odds_of_detection(0.01, {.parts = 100}, 50), 0.63, 0.005);
  EXPECT_NEAR(odds_of_detection(0.01, {.parts = 1000}, 20), 0.99996, 0.000005);
}

}  // namespace
}  // namespace lightmill::simulation
