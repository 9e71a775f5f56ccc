// Scene files that wait for a worker to read them: in memory alone, and nothing to do with jobs.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/domain/effects.h"

namespace lightmill {

struct InspectionLimits {
  std::size_t most = 64, most_per_caller = 4;    ///< that wait or are being read
  Duration patience = std::chrono::seconds(60);  ///< one that no worker has taken by then is given up
  /// A worker gives up after less; one that does not is no longer waited for, and gets no other until it reports.
  Duration reading = std::chrono::seconds(75);
  std::uint32_t losses = 2;  ///< with which so many workers were lost is not given to another
};

/// One at a time per worker; the oldest first. Each that was added is answered once, in a step's `inspected`, unless it
/// is forgotten. Pure, as Coordinator is.
class Inspections {
 public:
  /// A worker that may be given one.
  struct Candidate {
    std::string worker;
    SessionId session;
    std::size_t leases = 0;
  };

  /// Numbers count up from `first`.
  explicit Inspections(std::uint64_t first = 1, const InspectionLimits& limits = {}) : limits_(limits), next_(first) {}

  /// RESOURCE_EXHAUSTED. `caller` is whoever is to have no more than their share.
  Result<InspectionId> add(const std::string& caller, InspectionRequest request, Time now);
  /// Nobody waits for it any more.
  void forget(InspectionId id);

  /// Gives what waits to those that have none, fewest leases first.
  void serve(std::span<const Candidate> candidates, Time now, Step& step);
  void report(SessionId session, const InspectReport& report, Step& step);
  /// The session will report nothing. `lost`: what it read may be why.
  void left(SessionId session, bool lost, Time now, Step& step);
  void tick(Time now, Step& step);
  std::optional<Time> next_deadline() const;
  bool waiting() const;

 private:
  struct Waiting {
    std::string caller;
    std::shared_ptr<const InspectionRequest> request;
    Time deadline;
    std::optional<SessionId> reader;
    std::uint32_t lost = 0;
  };
  void answer(InspectionId id, Result<std::shared_ptr<const Inspection>> found, Step& step);

  const InspectionLimits limits_;
  std::uint64_t next_;
  std::map<InspectionId, Waiting> waiting_;
  std::map<SessionId, InspectionId> busy_;  ///< also with those that nobody waits for any more
};

}  // namespace lightmill
