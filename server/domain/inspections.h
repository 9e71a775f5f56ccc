// Inspections: scene files that wait for a worker to read them. Unrelated to jobs.
//
// Owns the waiting inspections, only in memory, and which session reads which. Takes requests, workers' reports, ends
// of sessions, and time.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/domain/worker_registry.h"

namespace lightmill {

struct InspectionLimits {
  std::size_t most = 64, most_per_caller = 4;   ///< inspections that wait or are read
  Duration timeout = std::chrono::seconds(90);  ///< an inspection that no worker takes within this time fails
  /// A worker itself stops sooner. If it does not, a worker of another identity reads the files. It gets no other
  /// inspection until it reports, and its identity gets the next ones last.
  Duration reading = std::chrono::seconds(75);
  std::uint32_t losses = 2;  ///< an inspection fails after this number of lost or silent workers
};

/// Queue of inspections. Takes reports and the ends of sessions. Each worker reads one at a time. Callers with the
/// fewest readers go first, then those that waited longest for a reader, then the oldest inspection. Each is answered
/// once, with the effects (`inspected`), unless it is forgotten.
class Inspections {
 public:
  /// Ids count up from `first`.
  Inspections(const WorkerRegistry& workers, std::uint64_t first) : workers_(workers), next_(first) {}

  /// UNAVAILABLE without a worker that reads scene files. RESOURCE_EXHAUSTED if too many wait, of all or of this
  /// caller.
  Result<InspectionId> add(const std::string& caller, InspectionRequest request, Time now);
  /// The caller no longer waits for it.
  void forget(InspectionId id) { waiting_.erase(id); }

  /// Gives waiting inspections to workers that have none: those whose identity missed the fewest deadlines first, then
  /// those with the fewest leases.
  void serve(const Event& event);
  void report(SessionId session, const InspectReport& report, const Event& event);
  /// The session will report nothing. `lost`: the files may be the cause.
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
    std::set<std::string> silent = {};  ///< identities that did not report in time
  };
  /// The next inspection without a reader that this identity may read; waiting_.end() if there is none.
  std::map<InspectionId, Waiting>::iterator next(const std::string& identity);
  /// Its reader missed the deadline. False if no other identity can read it, or too many readers missed it.
  bool pass_on(Waiting& waiting, const Event& event);
  void answer(InspectionId id, Result<std::shared_ptr<const Inspection>> found, const Event& event);

  const InspectionLimits limits_{};
  const WorkerRegistry& workers_;
  std::uint64_t next_;
  std::map<InspectionId, Waiting> waiting_;
  std::uint64_t readers_given_ = 0;
  std::map<std::string, std::uint64_t> last_reader_;  ///< by caller that waits: number of its last reader
  std::map<SessionId, InspectionId> busy_;            ///< also with forgotten inspections
  std::map<std::string, std::uint32_t> missed_;       ///< by identity: deadlines missed since its last report
};

}  // namespace lightmill
