// What one machine may do to a farm on purpose, tried many times by itself, and what came of it.
#pragma once

#include <string>

#include "tests/simulation/chaos.h"

namespace lightmill::simulation {

struct AttackTable {
  struct Row {
    std::string attack;
    std::uint64_t farms = 0;
    std::uint64_t attacked = 0;    ///< where it was carried out
    std::uint64_t convicted = 0;   ///< where somebody was put into quarantine
    std::uint64_t unverified = 0;  ///< where a job says that results are not verified
    std::uint64_t unnoticed = 0;   ///< where anything else was wrong: a picture above all
    std::string failure;           ///< the first of those, with its seed
  };
  std::vector<Row> rows;
  std::string text() const;
};

/// Tries each attack on so many farms, which all other faults befall, too. Where sums may be wrong, all results are
/// verified.
AttackTable try_attacks(std::uint64_t farms);

}  // namespace lightmill::simulation
