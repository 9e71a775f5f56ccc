// Effects of the coordinator's decisions: rows to store, messages to send, notes for the log.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/domain/stored_rows.h"

namespace lightmill {

/// A message for the worker of one session.
struct Outgoing {
  SessionId to;
  CoordinatorMessage message;
};

/// The leases that these messages grant.
inline std::vector<LeaseId> leases_granted(std::span<const Outgoing> messages) {
  std::vector<LeaseId> leases;
  for (const Outgoing& each : messages) {
    if (const auto* grant = std::get_if<LeaseGrant>(&each.message)) {
      leases.push_back(grant->lease);
    } else if (const auto* pilot = std::get_if<PilotGrant>(&each.message)) {
      leases.push_back(pilot->lease);
    }
  }
  return leases;
}

/// Line for the log.
struct Note {
  enum class Level { info, warning };
  Level level = Level::info;
  std::string text;
  // The job, worker or lease that it is about, if any.
  JobId job{};
  std::string worker = {};
  LeaseId lease{};
};

/// Counts of a worker at one moment. The last three only grow while the coordinator knows the worker.
struct WorkerCount {
  std::string name;
  std::uint32_t threads = 0, leases = 0;
  std::uint64_t results = 0, leases_lost = 0, pixel_samples = 0;
};

/// Answer for the client that asked for an inspection.
struct InspectionOutcome {
  InspectionId id;
  Result<std::shared_ptr<const Inspection>> found;
};

/// Outcome of a request for a film: it is in memory, or the error.
struct FilmOutcome {
  JobId job;
  Status status;
};

/// Effects of one or several events. `writes` are applied in order, in one transaction. `after_commit` and the answer
/// to a client are sent only after `writes` are durable. `now` may be sent at any time.
///
/// Effects are committed in their order. Several may share a transaction. `after_commit` waits until all earlier
/// effects are durable, even without writes of its own: an acknowledgement may depend on an earlier node. Within a
/// session, the messages of `now` keep their order, and so do those of `after_commit`.
struct Effects {
  std::vector<StoreOp> writes;
  std::vector<Outgoing> now;
  std::vector<Outgoing> after_commit;
  std::vector<SessionId> closed;             ///< sessions whose streams end at once
  std::vector<InspectionOutcome> inspected;  ///< sent at once: nothing of it is stored
  std::vector<Note> notes;
  std::vector<WorkerCount> departed;  ///< last counts of workers that the registry has forgotten
  std::vector<JobId> film_reads;      ///< films to read from the store, after these and all earlier writes
  std::vector<FilmOutcome> films;     ///< sent at once
};

}  // namespace lightmill
