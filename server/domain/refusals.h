// Refusals: what workers say of one job that they do not render.
//
// A refusal for the worker's own limits says nothing about the job. Any other one says that nobody can render it, and
// is one identity's word: it fails the job only when a second identity says so too, or nobody else is there to ask.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/clock.h"

namespace lightmill {

class Refusals {
 public:
  // ---- of what nobody can render ----
  /// Not called for an identity that is excluded.
  /// `certain`: nobody else has to be asked if nobody else is there.
  void add(const std::string& identity, const std::string& worker, const std::string& reason, bool certain = true);
  /// Workers of this identity do not get the job any more.
  bool excludes(const std::string& identity) const;
  bool empty() const { return said_.empty(); }
  std::size_t identities() const { return said_.size(); }
  /// Whether nobody else has to be asked, if nobody else is there.
  bool certain() const { return !said_.empty() && said_.front().certain; }
  /// Some of the job was rendered, or its pilot. Others than those who refused it can render it.
  void rendered_by(const std::string& identity) { refuted_ = refuted_ || (!empty() && !excludes(identity)); }
  bool refuted() const { return refuted_; }
  /// "worker a: mesh 'floor' is empty".
  std::string text() const;
  /// "waits for a worker of another identity: worker a refused it: mesh 'floor' is empty".
  std::string reason_to_wait() const;

  // ---- for workers' own limits ----
  void left_to_others(const std::string& identity, Time now);
  /// When a worker that connected then may get the job, unless it is excluded: processes of one identity that come one
  /// after the other, and leave it to others, get it less and less often.
  Time may_have_from(const std::string& identity, Time connected_at) const;

 private:
  struct Said {
    std::string identity, worker, reason;
    bool certain = true;
  };
  struct LeftToOthers {
    std::uint32_t times = 0;
    Time last;
  };
  std::vector<Said> said_;  ///< each identity once
  bool refuted_ = false;
  std::map<std::string, LeftToOthers> left_to_others_;  ///< by identity
};

}  // namespace lightmill
