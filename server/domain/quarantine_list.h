// List of workers in quarantine, and why: a check found them wrong, or an operator put them there. All other workers of
// their identities share the quarantine.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/domain/effects.h"

namespace lightmill {

/// Whether the quarantine of `guilty` is also that of `other`.
bool shares_guilt(const Renderer& guilty, const Renderer& other);
bool shares_guilt(const QuarantineRecord& guilty, const Renderer& other, std::string_view host);

class QuarantineList {
 public:
  explicit QuarantineList(std::vector<QuarantineRecord> stored);

  /// `host`: of a worker without certificate or token.
  bool contains(const Renderer& renderer, std::string_view host = {}) const;
  std::string reason_for(const Renderer& renderer, std::string_view host = {}) const;
  const QuarantineRecord* find(const std::string& worker) const;
  const std::map<std::string, QuarantineRecord>& all() const { return records_; }  ///< by worker

  /// Returns whether the list has changed. An entry of the same worker and identity stays, unless an operator
  /// made it and now a check has failed.
  bool put(const QuarantineRecord& record);
  /// Takes out the worker and those of its identity, or its host. Returns their names.
  std::vector<std::string> release(const Renderer& of, std::string_view host = {});

 private:
  std::map<std::string, QuarantineRecord> records_;
};

}  // namespace lightmill
