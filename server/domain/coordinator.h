// Coordinator without clock, threads, sockets or disk. It takes events with their time, and returns effects.
//
// Routes each event to the parts that own jobs, leases, workers and audits. coordinator_parts.h has them. Not
// thread-safe: the server calls it from one thread, the simulation from one seed. After a crash its state comes from
// the store, and from what workers send again.
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
#include "server/domain/farm_metrics.h"
#include "server/domain/limits.h"

namespace lightmill {

/// Filter for a list of jobs.
struct JobFilter {
  JobId before{std::numeric_limits<std::uint64_t>::max()};     ///< only older jobs
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< limit; the newest are taken
  bool unfinished = false;                                     ///< only jobs that have not ended
  std::set<JobState> states = {};                              ///< only these, as clients see them; empty: all
  std::function<bool(const JobRecord&)> admits = {};           ///< null admits all
};

/// Filter for a list of workers.
struct WorkerFilter {
  std::string after = {};                                      ///< only names after this one
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< limit
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
  bool connected = true;   ///< false only for workers in quarantine
  std::string quarantine;  ///< reason; empty if it is not in quarantine
};

class Coordinator {
 public:
  Coordinator(const CoordinatorLimits& limits, StoredState state, Time now);
  ~Coordinator();
  Coordinator(const Coordinator&) = delete;
  Coordinator& operator=(const Coordinator&) = delete;

  // ---- requests of clients; render_service.proto has the codes of errors ----
  /// `notes` tell how the method of `spec` was chosen, or between which methods a pilot chooses.
  Result<JobId> submit(const JobSpec& spec, Time now, std::int64_t unix_ms, Effects& effects,
                       const MethodNotes& notes = {});
  /// Whether a job was submitted with this request id. If so, submit returns it and changes nothing.
  bool knows_request(const std::string& request_id) const;
  Status cancel(JobId job, Time now, std::int64_t unix_ms, Effects& effects);
  Status pause(JobId job, Time now, Effects& effects);
  Status resume(JobId job, Time now, Effects& effects);
  /// Limits that `to` leaves out stay, unless the job has reached them. UNAVAILABLE if its film is not in memory
  /// (use_film).
  Status extend(JobId job, const Extension& to, Time now, Effects& effects);
  Status set_priority(JobId job, std::int32_t priority, Time now, Effects& effects);
  Status remove(JobId job, Time now, Effects& effects);
  /// Like remove, but first cancels a job that has not ended.
  Status discard(JobId job, Time now, std::int64_t unix_ms, Effects& effects);
  Status drain_worker(const std::string& name, Time now, Effects& effects);
  /// Puts the worker and all others of its identity into quarantine, and takes their leases back. With `render_again`,
  /// everything that they rendered a part of is rendered again. A worker that is already in quarantine keeps its own
  /// reason. `reason` begins with kByHand. NOT_FOUND unless the worker is connected or the farm has results of it.
  Status quarantine_worker(const std::string& name, const std::string& reason, bool render_again, Time now,
                           Effects& effects);
  /// Workers ask for this asset, and the server does not have it. The status of jobs that use it says so until workers
  /// stop asking.
  void asset_is_missing(const Sha256& digest, Time now, Effects& effects);
  /// Ends the quarantine of this worker and of all others of its identity.
  Status release_worker(const std::string& name, Time now, Effects& effects);
  /// Asks a worker to read scene files. The answer comes with the effects (`inspected`), unless it is forgotten.
  /// Errors: UNAVAILABLE, RESOURCE_EXHAUSTED.
  Result<InspectionId> inspect(const std::string& caller, InspectionRequest request, Time now, Effects& effects);
  void forget_inspection(InspectionId id);

  // ---- workers ----
  /// A stream opened and sent its hello. The caller chooses session ids, and never reuses one.
  void worker_connected(SessionId session, const WorkerHello& hello, Time now, Effects& effects);
  /// Any later message. Messages of unknown sessions are ignored. Results of a replaced session still count.
  void worker_message(SessionId session, WorkerMessage message, Time now, std::int64_t unix_ms, Effects& effects);
  /// The stream broke. Leases stay until they expire, because the worker may come back with them.
  void worker_disconnected(SessionId session, Time now, Effects& effects);
  /// Whether the farm has no place for a worker of this name that is not connected.
  bool is_full(const std::string& worker) const;
  /// The worker leaves its place to another. Its leases are given back, and its session ends.
  void evict_worker(SessionId session, Time now, Effects& effects);

  /// Workers send more than the coordinator can read now. Until their messages are read again, they do not time out.
  void note_backlog(Time now);

  /// The grants of these leases were in `after_commit`, and were sent at `now`. Before this call the leases do not
  /// expire, however slow the store is.
  void grants_sent(std::span<const LeaseId> leases, Time now);
  /// The rows with the ends of these jobs (ends_in) are durable. Before this call clients do not see the ends, because
  /// a killed coordinator would take them back.
  void ends_stored(std::span<const JobId> jobs);

  // ---- films: those of ended jobs may be only in the store ----
  /// Whether the job's film is in memory. If so, it stays until the next event. If not, the effects have it read
  /// (`film_reads`). Later effects say that it is in memory, or that reading takes too long (`films`). NOT_FOUND.
  Result<bool> use_film(JobId job, Time now, Effects& effects);
  /// The film that the store has read. Missing or damaged nodes are rendered again.
  void film_read(JobId job, Result<StoredFilm> film, Time now, Effects& effects);

  // ---- time ----
  /// Expires leases, ends jobs whose time is up, deletes jobs that ended long ago, and leases free work.
  void tick(Time now, std::int64_t unix_ms, Effects& effects);
  /// Stops leasing. The status of jobs that wait gives `why`. Results are still taken. An empty `why` resumes leasing.
  void hold(const std::string& why, Time now, Effects& effects);
  /// When tick next has something to do, if no other event comes.
  std::optional<Time> next_deadline() const;

  // ---- queries ----
  /// A job as clients see it. Its end is shown when it is stored.
  Result<JobStatus> status(JobId job, Time now) const;
  /// With an end that is not stored yet: for answers that are sent after the commit.
  Result<JobStatus> decided_status(JobId job, Time now) const;
  std::vector<JobStatus> jobs(Time now, const JobFilter& filter = {}) const;  ///< newest first
  std::size_t count_jobs(const JobFilter& filter) const;
  FarmLoad load() const;
  const FarmTotals& totals() const;
  FarmGauges gauges(Time now) const;
  std::vector<WorkerStatus> workers(Time now, const WorkerFilter& filter = {}) const;  ///< by name
  /// Number of workers that the farm can use, for autoscalers:
  /// - enough that each has a minute of work in the remaining samples of all jobs, and at least the busy ones;
  /// - for a job that ends only by time, a thread for each of its tiles;
  /// - for a job whose sample cost is unknown, or that ends within a minute, the connected workers;
  /// - 1 while no connected worker can render any job, 0 if no job is in progress.
  /// Workers in quarantine are added, because an autoscaler counts them and they do nothing.
  std::uint32_t wanted_workers(Time now) const;
  /// Whether wanted_workers is more than 0. Cheaper.
  bool wants_workers() const;
  /// Why leasing is stopped; empty while it is not.
  const std::string& held() const;
  /// Valid until the next event.
  Result<const JobSpec*> spec(JobId job) const;
  /// Assets of all jobs, or of the jobs that name `of_jobs_with`.
  std::set<Sha256> assets(const std::optional<Sha256>& of_jobs_with = {}) const;
  Result<std::string> owner(JobId job) const;
  /// Sample ranges of a job's film; null if there is no such job. Valid until the next event.
  const FilmOutline* outline(JobId job) const;
  /// The film of a job; null if it is not in memory, or there is no such job. Valid until the next event.
  const Film* film(JobId job) const;
  /// Grows with every change of the job's state or film; 0 if there is no such job.
  std::uint64_t version(JobId job) const;
  /// Versions of the `most` newest jobs.
  std::vector<std::pair<JobId, std::uint64_t>> versions(std::size_t most) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace lightmill
