// Inspections: scene files that wait for a worker to read them. In memory alone, and unrelated to jobs.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/domain/workers.h"

namespace lightmill {

struct InspectionLimits {
  std::size_t most = 64, most_per_caller = 4;    ///< that wait or are being read
  Duration patience = std::chrono::seconds(60);  ///< one that no worker has taken by then is given up
  /// A worker gives up after less; one that does not is no longer waited for, and gets no other until it reports.
  Duration reading = std::chrono::seconds(75);
  std::uint32_t losses = 2;  ///< with which so many workers were lost is not given to another
};

/// Each worker reads one at a time; the oldest goes first. Each is answered once, among the effects (`inspected`),
/// unless it is forgotten.
class Inspections {
 public:
  /// Numbers count up from `first`.
  Inspections(const WorkerRegistry& workers, std::uint64_t first) : workers_(workers), next_(first) {}

  /// UNAVAILABLE without a worker that reads scene files, RESOURCE_EXHAUSTED. Each caller has a share of what may wait.
  Result<InspectionId> add(const std::string& caller, InspectionRequest request, Time now);
  /// The caller does not wait for it any more.
  void forget(InspectionId id) { waiting_.erase(id); }

  /// Gives inspections that wait to workers that have none, fewest leases first.
  void serve(const Event& event);
  void report(SessionId session, const InspectReport& report, const Event& event);
  /// The session will report nothing. `lost`: the files that it read may be why.
  void left(SessionId session, bool lost, const Event& event);
  void tick(const Event& event);
  std::optional<Time> next_deadline() const;

 private:
  struct Waiting {
    std::string caller;
    std::shared_ptr<const InspectionRequest> request;
    Time deadline;
    std::optional<SessionId> reader;
    std::uint32_t lost = 0;
  };
  void answer(InspectionId id, Result<std::shared_ptr<const Inspection>> found, const Event& event);

  const InspectionLimits limits_{};
  const WorkerRegistry& workers_;
  std::uint64_t next_;
  std::map<InspectionId, Waiting> waiting_;
  std::map<SessionId, InspectionId> busy_;  ///< also with inspections that were forgotten
};

}  // namespace lightmill
