// List of workers in quarantine, and why: a check found them wrong, or an operator put them there. All
// other workers on their machines share the quarantine.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/domain/effects.h"

namespace lightmill {

/// Whether the quarantine of `guilty` is also that of `other`.
bool shares_guilt(const Renderer& guilty, const Renderer& other);

class QuarantineList {
 public:
  explicit QuarantineList(std::vector<QuarantineRecord> stored);

  bool contains(const Renderer& renderer) const;
  std::string reason_for(const Renderer& renderer) const;
  const QuarantineRecord* find(const std::string& worker) const;
  const std::map<std::string, QuarantineRecord>& all() const { return records_; }  ///< by worker

  /// Returns whether the list has changed. An entry of the same worker on the same machine stays, unless an operator
  /// made it and now a check has failed.
  bool put(const QuarantineRecord& record);
  /// Takes out the worker and those on its machine. Returns their names.
  std::vector<std::string> release(const Renderer& of);

 private:
  std::map<std::string, QuarantineRecord> records_;
};

}  // namespace lightmill
