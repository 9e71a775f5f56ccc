// List of workers in quarantine, each with its reason: an audit found it wrong, or an operator put it there. All other
// workers of its identity share the quarantine.
//
// Owns these records. Takes new ones, and releases.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/domain/stored_rows.h"

namespace lightmill {

/// Whether `other` shares the quarantine of `faulty`.
bool shares_quarantine(const Renderer& faulty, const Renderer& other);
bool shares_quarantine(const QuarantineRecord& faulty, const Renderer& other, std::string_view host);

class QuarantineList {
 public:
  explicit QuarantineList(std::vector<QuarantineRecord> stored);

  /// `host`: set for a worker without certificate or token.
  bool contains(const Renderer& renderer, std::string_view host = {}) const;
  std::string reason_for(const Renderer& renderer, std::string_view host = {}) const;
  const QuarantineRecord* find(const std::string& worker) const;
  const std::map<std::string, QuarantineRecord>& all() const { return records_; }  ///< by worker

  /// Returns whether the list has changed. An entry of the same worker and identity stays. But an entry from an
  /// operator is replaced after a failed audit.
  bool put(const QuarantineRecord& record);
  /// Removes the worker and all others of its identity or host. Returns their names.
  std::vector<std::string> release(const Renderer& of, std::string_view host = {});

 private:
  std::map<std::string, QuarantineRecord> records_;
};

}  // namespace lightmill
