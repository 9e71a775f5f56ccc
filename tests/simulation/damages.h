// Damage to the files of a farm between two coordinators: any bit, sector, row or file of its store.
//
// A farm is stopped somewhere, its files are damaged, and another coordinator starts on them. Then the farm finishes
// its jobs, with the bits that it would have had, or says what is lost. Nothing is lost or changed in silence.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace lightmill::simulation {

struct DamageReport {
  std::string kind;     ///< "database: a flipped bit"
  std::string outcome;  ///< a column of the table
  std::string failure;  ///< empty: all is well
};

/// The columns of a table of damages.
inline constexpr const char* kDamageOutcomes[] = {"same bits", "rendered again", "sent again", "named", "refused"};

/// One damage of one farm, drawn from the seed. `forge` is a planted bug: a node's bits and its hash are changed alike,
/// as if nodes had no hash.
DamageReport damage_one(std::uint64_t seed, bool forge = false);

/// Damages of these seeds, counted by kind and outcome.
class DamageTable {
 public:
  void add(const DamageReport& report) { ++counts_[report.kind][report.outcome]; }
  std::string text() const;
  const std::map<std::string, std::map<std::string, std::uint64_t>>& counts() const { return counts_; }

 private:
  std::map<std::string, std::map<std::string, std::uint64_t>> counts_;
};

}  // namespace lightmill::simulation
