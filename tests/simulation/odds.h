// Odds table: how often audits find a worker that falsifies results, compared with the theory.
#pragma once

#include <string>
#include <vector>

#include "tests/simulation/chaos.h"

namespace lightmill::simulation {

/// Probability that audits of `share` find the deceit, if each of its results has `parts` parts. Each part is drawn
/// with the probability `share`, independently. If any part is drawn, another identity renders the result again. If the
/// two differ, a third one decides, and the liar is found. So a result that is wrong with probability w reveals the
/// liar with probability q = w (1 - (1 - share)^parts), and all m results miss it with (1 - q)^m. For w = 1 that is (1
/// - share)^(m parts): only the number of all parts counts.
double odds_of_detection(double share, const Deceit& deceit, double parts);

struct OddsTable {
  struct Row {
    std::string liar;
    double share = 0;  ///< of the results, audited
    double parts = 0;  ///< of the deceit
    double farms = 0, found = 0;
    double expected_found = 0, variance = 0;  ///< of `found`, by the theory
    bool at_least = false;                    ///< the theory gives a lower limit
    std::string failure = {};                 ///< of the first farm that failed, with its seed; empty: none
    void add(double probability, bool is_found);
    void add(const Row& row);
    double deviation() const;  ///< in standard errors; 0 if `found` is exactly as expected
  };
  std::vector<Row> rows;  ///< the last one has the sums of all but lower limits
  /// Largest deviation, without its sign. Infinite if a farm failed. More than a lower limit is no deviation.
  double worst() const;
  std::string text() const;
};

/// Tries each kind of liar with each share of audits on this number of farms.
OddsTable measure_odds(std::uint64_t farms, const PlantedBugs& bugs = {});

}  // namespace lightmill::simulation
