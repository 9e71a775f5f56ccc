// Coordinator without clock, threads, sockets and disk: events in, with their time; effects out.
//
// Routes each event to the parts that own jobs, leases, workers and audits (coordinator.cpp says to which, in which
// order). Not thread-safe: the server feeds it from one thread, the simulation from one seed. What it forgets in a
// crash is in the store, or workers send it again.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/domain/farm_history.h"
#include "server/domain/farm_totals.h"
#include "server/domain/limits.h"

namespace lightmill {

/// Choice of the jobs in a list.
struct JobFilter {
  JobId before{std::numeric_limits<std::uint64_t>::max()};     ///< older ones only
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< the newest so many
  bool unfinished = false;                                     ///< only those that have not ended
  std::function<bool(const JobRecord&)> admits = {};           ///< null: all
};

/// Choice of the workers in a list.
struct WorkerFilter {
  std::string after = {};                                      ///< only names that come later
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< the first so many
};

/// New limits for a job. 0 leaves a limit as it is.
struct Extension {
  std::uint64_t samples = 0;  ///< the new total, per pixel
  double error = 0;           ///< as Goal::error
};

/// A worker as clients see it.
struct WorkerStatus {
  std::string name, host, fingerprint_class;
  std::uint32_t pid = 0, threads = 1, leases = 0;
  bool draining = false;
  double samples_per_second = 0, connected_seconds = 0;
  std::uint64_t results = 0, leases_lost = 0;
  bool connected = true;   ///< false only of workers in quarantine
  std::string quarantine;  ///< why it gets nothing to render; empty if it does
};

class Coordinator {
 public:
  Coordinator(const CoordinatorLimits& limits, StoredState state, Time now);
  ~Coordinator();
  Coordinator(const Coordinator&) = delete;
  Coordinator& operator=(const Coordinator&) = delete;

  // ---- what clients ask; errors have the codes that render_service.proto states ----
  /// `notes` say how the method of `spec` was found, or which methods a pilot is to choose from.
  Result<JobId> submit(const JobSpec& spec, Time now, std::int64_t unix_ms, Effects& effects,
                       const MethodNotes& notes = {});
  /// Whether a job was submitted with this request id. If so, submit returns it and changes nothing.
  bool knows_request(const std::string& request_id) const;
  Status cancel(JobId job, Time now, std::int64_t unix_ms, Effects& effects);
  Status pause(JobId job, Time now, Effects& effects);
  Status resume(JobId job, Time now, Effects& effects);
  /// Limits that are not named stay, unless the job has reached them. UNAVAILABLE if its film is not in memory
  /// (use_film).
  Status extend(JobId job, const Extension& to, Time now, Effects& effects);
  Status set_priority(JobId job, std::int32_t priority, Time now, Effects& effects);
  Status remove(JobId job, Time now, Effects& effects);
  /// As remove, and cancels the job first if it has not ended.
  Status discard(JobId job, Time now, std::int64_t unix_ms, Effects& effects);
  Status drain_worker(const std::string& name, Time now, Effects& effects);
  /// The worker and all others of its identity get nothing to render until they are released. Their leases are taken
  /// back. With `render_again`, everything in which they had a part is rendered again. A worker that is in quarantine
  /// already stays there for its own reason. `reason` begins with kByHand. NOT_FOUND, unless the worker is here or the
  /// farm has results of it.
  Status quarantine_worker(const std::string& name, const std::string& reason, bool render_again, Time now,
                           Effects& effects);
  /// Workers ask for this asset and do not get it. Jobs that have it say so until workers stop asking.
  void asset_is_missing(const Sha256& digest, Time now, Effects& effects);
  /// Ends the quarantine of this worker, and of those of its identity.
  Status release_worker(const std::string& name, Time now, Effects& effects);
  /// Has a worker read scene files. The answer comes among the effects (`inspected`), unless it is forgotten.
  /// UNAVAILABLE, RESOURCE_EXHAUSTED.
  Result<InspectionId> inspect(const std::string& caller, InspectionRequest request, Time now, Effects& effects);
  void forget_inspection(InspectionId id);

  // ---- what workers do ----
  /// A stream opened and said hello. Session ids are chosen by the caller and never reused.
  void worker_connected(SessionId session, const WorkerHello& hello, Time now, Effects& effects);
  /// Any later message. A message of an unknown session is ignored; results of one that was replaced still count.
  void worker_message(SessionId session, WorkerMessage message, Time now, std::int64_t unix_ms, Effects& effects);
  /// The stream broke. Leases are kept until they expire: the worker may come back with them.
  void worker_disconnected(SessionId session, Time now, Effects& effects);
  /// Whether a worker of this name, which is not here, finds no place.
  bool is_full(const std::string& worker) const;
  /// The worker leaves its place to another: its leases are given back, and its session ends.
  void worker_gives_way(SessionId session, Time now, Effects& effects);

  /// More comes from workers than can be read now. Until they are heard again, their silence proves nothing.
  void cannot_keep_up(Time now);

  /// The grants of these leases were among `after_commit`, and left at `now`. Before this call they do not expire,
  /// however long the store takes.
  void grants_sent(std::span<const LeaseId> leases, Time now);

  // ---- films: those of ended jobs may be in the store alone ----
  /// Whether the job's film is in memory; then it is until the next event. If not, the effects have it read
  /// (`film_reads`), and say when it is there (`films`), or that it takes too long. NOT_FOUND.
  Result<bool> use_film(JobId job, Time now, Effects& effects);
  /// What the store holds of a film that was to be read. Nodes that are not there, or not sound, are rendered again.
  void film_read(JobId job, Result<StoredFilm> film, Time now, Effects& effects);

  // ---- time ----
  /// Expires leases, ends jobs whose seconds are over, deletes jobs that ended long ago, hands out free work.
  void tick(Time now, std::int64_t unix_ms, Effects& effects);
  /// Nothing is leased from now on, and jobs that wait say `why`. Results are still taken. Empty: leasing resumes.
  void hold(const std::string& why, Time now, Effects& effects);
  /// When tick has something to do next, if nothing else happens.
  std::optional<Time> next_deadline() const;

  // ---- what can be seen ----
  Result<JobStatus> status(JobId job, Time now) const;
  std::vector<JobStatus> jobs(Time now, const JobFilter& filter = {}) const;  ///< newest first
  std::size_t count_jobs(const JobFilter& filter) const;
  FarmCounts counts() const;
  const FarmTotals& totals() const;
  FarmSnapshot snapshot() const;
  std::vector<WorkerStatus> workers(Time now, const WorkerFilter& filter = {}) const;  ///< by name
  /// How many workers the farm could use, for autoscalers:
  /// - as many as have a minute's work each in what is left of all jobs, and no fewer than are at work;
  /// - for a job that time alone ends, a thread for each of its tiles;
  /// - for a job whose samples have no known cost, or that ends within a minute, the workers that are here;
  /// - 1 while no worker is here that could render any job, 0 if no job is in progress.
  /// Workers in quarantine come on top: they have a place and do nothing.
  std::uint32_t wanted_workers(Time now) const;
  /// Whether that is more than 0, which is cheaper to know.
  bool wants_workers() const;
  /// Why no work is handed out; empty while it is.
  const std::string& held() const;
  /// Valid until the next event.
  Result<const JobSpec*> spec(JobId job) const;
  /// Of all jobs.
  std::set<Sha256> assets() const;
  Result<std::string> owner(JobId job) const;
  /// Which samples a job's film has; null if there is no such job. Valid until the next event.
  const FilmOutline* outline(JobId job) const;
  /// The film of a job; null if it is not in memory, or there is no such job. Valid until the next event.
  const Film* film(JobId job) const;
  /// Grows with every change of the job's state or film; 0 if there is no such job.
  std::uint64_t version(JobId job) const;
  /// Of the newest jobs, at most so many.
  std::vector<std::pair<JobId, std::uint64_t>> versions(std::size_t most) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace lightmill
