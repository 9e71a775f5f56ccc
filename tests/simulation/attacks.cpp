#include "tests/simulation/attacks.h"

#include <fmt/format.h>

#include <algorithm>

#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {
namespace {

struct Kind {
  Attack attack;
  const char* name;
  const char* fault;  ///< fault that World counts for it; null: Report::lied is set
};

constexpr Kind kKinds[] = {
    {Attack::wrong_sums, "wrong pictures, always", nullptr},
    {Attack::some_wrong_sums, "wrong pictures, sometimes", nullptr},
    {Attack::two_names, "two workers with one certificate lie alike", nullptr},
    {Attack::claims, "claims others' machines; comes back under new names", nullptr},
    {Attack::ungranted, "results without a lease", "results that were not granted"},
    {Attack::garbage, "messages of garbage", "messages of garbage"},
    {Attack::idle, "holds leases and delivers nothing", "tiles that are never delivered"},
    {Attack::losses, "loses its leases on purpose", "leases lost on purpose"},
    {Attack::second_identity, "comes with a second identity after it was found", "liars with a second identity"},
    {Attack::spite, "refuses what it could render", "refusals out of spite"},
};

}  // namespace

AttackTable::Row try_attack(Attack attack, std::uint64_t farms, const PlantedBugs& bugs) {
  const Kind& kind = *std::ranges::find(kKinds, attack, &Kind::attack);
  AttackTable::Row row;
  row.attack = kind.name;
  for (std::uint64_t seed = 1; seed <= farms; ++seed) {
    Chaos chaos;
    chaos.attack = attack;
    const Report report = FarmSimulation(seed, chaos, bugs).run();
    ++row.farms;
    row.attacked += kind.fault == nullptr ? report.lied : report.faults.contains(kind.fault);
    row.quarantined += report.quarantined > 0;
    row.unaudited += report.unaudited > 0;
    if (!report.failure.empty() && row.unnoticed++ == 0) {
      row.failure = fmt::format("seed {}: {}", seed, report.failure);
    }
  }
  return row;
}

AttackTable try_attacks(std::uint64_t farms) {
  AttackTable table;
  for (const Kind& kind : kKinds) {
    table.rows.push_back(try_attack(kind.attack, farms));
  }
  return table;
}

std::string AttackTable::text() const {
  std::string text = fmt::format("{:55} {:>8} {:>9} {:>12} {:>11} {:>10}\n", "attack", "farms", "attacked",
                                 "quarantined", "unaudited", "unnoticed");
  for (const Row& row : rows) {
    text += fmt::format("{:55} {:>8} {:>9} {:>12} {:>11} {:>10}\n", row.attack, row.farms, row.attacked,
                        row.quarantined, row.unaudited, row.unnoticed);
    text += row.failure.empty() ? "" : "  " + row.failure + "\n";
  }
  return text;
}

}  // namespace lightmill::simulation
