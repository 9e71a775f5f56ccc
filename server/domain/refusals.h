// Refusals: workers' reasons not to render one job.
//
// A refusal for the worker's own limits says nothing about the job. Any other refusal claims that no worker can render
// it. It fails the job only when a second identity refuses too, or when no other is connected. Claims of any number of
// identities do not fail a job that another connected identity has rendered.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/base/clock.h"

namespace lightmill {

class Refusals {
 public:
  enum class Cause {
    claim,    ///< a worker says that no worker can render the job
    loss,     ///< workers were lost with the job, or held it without a result
    overrun,  ///< a part took too much CPU time
  };

  // ---- of a job that no worker can render ----
  /// Not called for an excluded identity. `worker`: empty if the reason names workers.
  void add(const std::string& identity, const std::string& worker, const std::string& reason, Cause cause);
  /// Workers of this identity no longer get the job.
  bool excludes(const std::string& identity) const;
  bool empty() const { return refusals_.empty(); }
  std::size_t identities() const { return refusals_.size(); }
  /// Whether the job may fail without a second identity.
  bool certain() const { return !refusals_.empty() && refusals_.front().cause != Cause::overrun; }
  /// A part of the job, or its pilot, was rendered. So identities that did not refuse it can render it.
  void rendered_by(const std::string& identity);
  /// An identity that did not refuse it has rendered a part since the first refusal.
  bool refuted() const { return refuted_; }
  /// All refusals are claims, and an identity that did not refuse has rendered a part.
  bool are_denied() const;
  /// "worker a: mesh 'floor' is empty".
  std::string text() const;
  /// "waits for a worker of another identity: worker a refused it: mesh 'floor' is empty".
  std::string reason_to_wait() const;

  // ---- for workers' own limits ----
  void left_to_others(const std::string& identity, Time now);
  /// Whether no worker has refused the job, or left it to others.
  bool none() const { return refusals_.empty() && left_to_others_.empty(); }
  /// The identity had a lease for long without a result. All its workers get the job later.
  void held_in_silence(const std::string& identity, Time now);
  /// The identity ended a lease itself, after this time without a result. Returns the sum since its last result.
  Duration add_silence(const std::string& identity, Duration time);
  /// When a worker that connected at `connected_at` may get the job, unless it is excluded. An identity whose processes
  /// leave the job to others again and again gets it less often.
  Time may_have_from(const std::string& identity, Time connected_at) const;

 private:
  struct Refusal {
    std::string identity, worker, reason;
    Cause cause = Cause::claim;
    std::string text() const;
  };
  struct LeftToOthers {
    std::uint32_t times = 0;
    Time last;
  };
  static void count(std::map<std::string, LeftToOthers>& rows, const std::string& identity, Time now);
  std::vector<Refusal> refusals_;    ///< each identity once
  std::set<std::string> renderers_;  ///< identities, up to kMaxRenderers
  bool refuted_ = false;
  std::map<std::string, LeftToOthers> left_to_others_, held_in_silence_;  ///< by identity
  std::map<std::string, Duration> silence_;                               ///< by identity, see add_silence()
};

}  // namespace lightmill
