// Attack table: each attack by one machine, tried alone on many farms, with the outcomes.
#pragma once

#include <string>

#include "tests/simulation/chaos.h"

namespace lightmill::simulation {

struct AttackTable {
  struct Row {
    std::string attack;
    std::uint64_t farms = 0;
    std::uint64_t attacked = 0;     ///< farms with at least one attack
    std::uint64_t quarantined = 0;  ///< farms with a worker in quarantine
    std::uint64_t unaudited = 0;    ///< farms with a job that reports unaudited results
    std::uint64_t unnoticed = 0;    ///< farms with any other failure, such as a wrong picture
    std::string failure;            ///< the first of these failures, with its seed
  };
  std::vector<Row> rows;
  std::string text() const;
};

/// Tries the attack on this number of farms, with all other faults. If sums may be wrong, all results are audited.
AttackTable::Row try_attack(Attack attack, std::uint64_t farms, const PlantedBugs& bugs = {});
/// The same for each attack.
AttackTable try_attacks(std::uint64_t farms);

}  // namespace lightmill::simulation
