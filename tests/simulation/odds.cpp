#include "tests/simulation/odds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {
namespace {

constexpr double kShares[] = {0.01, 0.1, 1};

/// Kind of liar. Each result of its deceit has `parts` parts, or a multiple up to `most_parts`.
struct LiarKind {
  const char* name;
  double parts, most_parts;
  double wrong;
  double tile_seconds;  ///< of the race: the slower workers are, the smaller their results
  std::size_t liars = 1;
  bool new_names = false, know_audits = true;
};

// The job has 128 tiles of 64 samples. A result of one tile and 2^k samples of its second half has 2^k * 0.1220703125
// parts. While the film has less than half of the samples, results have more.
constexpr double kSixteen = 1.953125, kThirtyTwo = 3.90625, kFirst = 3.90625;

constexpr LiarKind kLiarKinds[] = {
    {"always wrong", 1, 1, 1, 0.1},
    {"wrong in a tenth of its results", 1, 1, 0.1, 0.1},
    {"chooses large results", kThirtyTwo, kThirtyTwo, 1, 0.01},
    {"chooses results before audits begin", kFirst, kFirst, 1, 0.03},
    {"all sizes, under new names", kSixteen, 1000, 1, 0.03, 1, true},
    {"all sizes, two workers lie alike", kSixteen, 1000, 1, 0.03, 2},
    {"always wrong, in audits too", 1, 1, 1, 0.1, 1, false, false},
};

/// The number of results for which the odds are about one half, at most 100.
double results_for(double share, const LiarKind& kind) {
  const double q = odds_of_detection(share, {.parts = kind.parts, .wrong = kind.wrong}, kind.parts);
  return q == 1 ? 1 : std::min(std::ceil(std::log(0.5) / std::log1p(-q)), 100.0);
}

Race race_with(const LiarKind& kind, double share) {
  Race race{.tile_seconds = kind.tile_seconds, .audit_share = share};
  race.slowness.assign(2 + kind.liars, 1);
  race.deceit = Deceit{.liars = kind.liars,
                       .least_parts = kind.parts,
                       .most_parts = kind.most_parts,
                       .parts = results_for(share, kind) * kind.parts,
                       .wrong = kind.wrong,
                       .new_names = kind.new_names,
                       .know_audits = kind.know_audits};
  return race;
}

}  // namespace

double odds_of_detection(double share, const Deceit& deceit, double parts) {
  const double audited = 1 - std::pow(1 - share, parts);
  return 1 - std::pow(1 - deceit.wrong * audited, deceit.parts / parts);
}

void OddsTable::Row::add(double probability, bool is_found) {
  ++farms;
  found += is_found;
  expected_found += probability;
  variance += probability * (1 - probability);
}

void OddsTable::Row::add(const Row& row) {
  farms += row.farms;
  found += row.found;
  expected_found += row.expected_found;
  variance += row.variance;
}

double OddsTable::Row::deviation() const {
  const double difference = found - expected_found;
  return difference == 0 ? 0 : difference / std::sqrt(variance);
}

double OddsTable::worst() const {
  double worst = 0;
  for (const Row& row : rows) {
    const double deviation = row.at_least ? -row.deviation() : std::abs(row.deviation());
    worst = std::max(worst, row.failure.empty() ? deviation : std::numeric_limits<double>::infinity());
  }
  return worst;
}

OddsTable measure_odds(std::uint64_t farms, const PlantedBugs& bugs) {
  OddsTable table;
  OddsTable::Row all{.liar = "all"};
  std::uint64_t seed = 0;
  for (const LiarKind& kind : kLiarKinds) {
    for (const double share : kShares) {
      const Race race = race_with(kind, share);
      OddsTable::Row row{.liar = kind.name, .share = share, .parts = race.deceit->parts, .at_least = !kind.know_audits};
      for (std::uint64_t i = 0; i < farms; ++i) {
        const Report report = FarmSimulation(++seed, race, bugs).run();
        row.add(odds_of_detection(share, *race.deceit, kind.parts), report.quarantined > 0);
        if (row.failure.empty() && !report.failure.empty()) {
          row.failure = fmt::format("seed {}: {}", seed, report.failure);
        } else if (row.failure.empty() && report.quarantined == 0 && report.deceit_parts != race.deceit->parts) {
          row.failure = fmt::format("seed {}: the film has {} parts of the deceit instead of {}", seed,
                                    report.deceit_parts, race.deceit->parts);
        }
      }
      if (!row.at_least) {
        all.add(row);
      }
      table.rows.push_back(std::move(row));
    }
  }
  table.rows.push_back(std::move(all));
  return table;
}

std::string OddsTable::text() const {
  std::string text = fmt::format("{:34} {:>7} {:>6} {:>6} {:>9} {:>9} {:>10} {:>10}\n", "liar", "audited", "parts",
                                 "farms", "expected", "measured", "std. error", "deviation");
  for (const Row& row : rows) {
    text += fmt::format("{:34} {:>7} {:>6} {:>6} {:>9} {:>9.4f} {:>10.4f} {:>+10.2f}\n", row.liar,
                        row.share == 0 ? "" : fmt::format("{:.0f} %", 100 * row.share),
                        row.parts == 0 ? "" : fmt::format("{:.2f}", row.parts), row.farms,
                        fmt::format("{}{:.4f}", row.at_least ? ">= " : "", row.expected_found / row.farms),
                        row.found / row.farms, std::sqrt(row.variance) / row.farms, row.deviation());
    text += row.failure.empty() ? "" : "  " + row.failure + "\n";
  }
  return text;
}

}  // namespace lightmill::simulation
