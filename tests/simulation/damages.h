// Damage to the files of a farm between two coordinators: a bit, sector, page, row or file of its store.
//
// A farm is stopped at any point, its files are damaged, and another coordinator starts on them. Then the farm finishes
// its jobs with the same bits, or reports what is lost. Nothing is lost or changed silently.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace lightmill::simulation {

struct DamageReport {
  std::string kind;     ///< "database: a flipped bit"
  std::string outcome;  ///< column of the table
  std::string failure;  ///< empty: no failure
};

/// Columns of a table of damages.
inline constexpr const char* kDamageOutcomes[] = {"same bits", "rendered again", "sent again", "named", "refused"};

/// One damage of one farm, drawn from the seed. `forge` is a planted bug: it changes a node's bits together with its
/// hash and the sums over rows, as if there were neither.
DamageReport damage_one(std::uint64_t seed, bool forge = false);

/// Table of damages, counted by kind and outcome.
class DamageTable {
 public:
  void add(const DamageReport& report) { ++counts_[report.kind][report.outcome]; }
  std::string text() const;
  const std::map<std::string, std::map<std::string, std::uint64_t>>& counts() const { return counts_; }

 private:
  std::map<std::string, std::map<std::string, std::uint64_t>> counts_;
};

}  // namespace lightmill::simulation
