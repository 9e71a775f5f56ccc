// The coordinator without its clock, threads, sockets and disk: events in, with their time; decisions out.
//
// Owns jobs, films, leases and what is known of workers. Not thread-safe: the server feeds it from one thread, the
// simulation from one seed. Everything it forgets in a crash is either in the store or resent by workers.
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

namespace lightmill {

class Film;  // common/film/film.h

/// Which jobs a list has.
struct JobFilter {
  JobId before{std::numeric_limits<std::uint64_t>::max()};     ///< older ones only
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< the newest so many
  bool unfinished = false;                                     ///< only those that have not ended
  std::function<bool(const std::string& owner)> admits = {};   ///< null: whoever they belong to
};

/// Which workers a list has.
struct WorkerFilter {
  std::string after = {};                                      ///< only names that come later
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< the first so many
};

/// Stated bounds; every queue has one.
struct CoordinatorLimits {
  Duration heartbeat_interval = std::chrono::seconds(2);
  Duration lease_duration = std::chrono::seconds(20);  ///< without renewal a lease is lost
  /// A worker that says nothing for so long is hung up on: dead links are not always found by the connection.
  Duration silence = std::chrono::seconds(30);
  double unit_seconds = 1.0;  ///< aim of a unit, of its worker's measured speed; longer where results would be too many
  double result_bytes_per_second = 192.0 * 1024 * 1024;  ///< that all workers send together, at most
  std::uint32_t leases_per_worker = 2;                   ///< one to work on, one ahead
  Duration disconnect_grace = std::chrono::seconds(3);   ///< leases of a broken stream are lost after so long
  Duration restart_grace = std::chrono::seconds(2);      ///< after a start, workers may come back with what they hold
  Duration copy_after = std::chrono::milliseconds(100);  ///< no lease is copied to an idle worker before it is so old
  Duration copy_pilot_after = std::chrono::milliseconds(500);  ///< likewise of pilots, whose time is not foreseen
  /// Of nodes that are out or wait to be joined; never below four nodes a tile.
  std::uint64_t film_bytes_per_job = std::uint64_t{1} << 30;
  std::uint64_t film_bytes = std::uint64_t{8} << 30;  ///< of all films together when they are done; more is refused
  /// A tile (or pilot) with which so many workers were lost in a row, nothing of it having come, goes to workers that
  /// have nothing else; once it has lost so many of those its job fails.
  std::uint32_t losses_before_alone = 2, losses_alone = 3;
  std::uint32_t max_bad_results = 3;  ///< a worker that sends so many damaged results is dismissed
  /// A job whose film is complete waits for a machine that could verify some of it and was here so lately.
  Duration verifier_patience = std::chrono::seconds(45);
  std::uint32_t max_jobs = 10'000;
  std::uint32_t max_jobs_per_owner = 2'000;
  std::uint32_t max_workers = 10'000;
  Duration keep_ended{};  ///< jobs that have ended are deleted after so long; 0: never
};

/// New limits for a job; 0: as it is.
struct Extension {
  std::uint64_t samples = 0;  ///< the new total, per pixel
  double error = 0;           ///< as Goal::error
};

/// A worker as people see it.
struct WorkerStatus {
  std::string name, host, fingerprint_class;
  std::uint32_t pid = 0, threads = 1, leases = 0;
  bool draining = false;
  double samples_per_second = 0, connected_seconds = 0;
  std::uint64_t results = 0, leases_lost = 0;
  bool connected = true;   ///< false only of those in quarantine
  std::string quarantine;  ///< why it gets nothing to render; empty if it does
};

class Coordinator {
 public:
  Coordinator(const CoordinatorLimits& limits, StoredState state, Time now);
  ~Coordinator();
  Coordinator(const Coordinator&) = delete;
  Coordinator& operator=(const Coordinator&) = delete;

  // ---- what clients ask; errors have the codes that render_service.proto states ----
  /// `notes` say how the method of `spec` was found, or of which ones a pilot is to pick it.
  Result<JobId> submit(const JobSpec& spec, Time now, std::int64_t unix_ms, Step& step, const MethodNotes& notes = {});
  /// Whether a job was submitted with this request id: submit then answers with that one, and changes nothing.
  bool knows_request(const std::string& request_id) const;
  Status cancel(JobId job, Time now, std::int64_t unix_ms, Step& step);
  Status pause(JobId job, Time now, Step& step);
  Status resume(JobId job, Time now, Step& step);
  /// Limits that are not named stay, but those that the job has reached.
  Status extend(JobId job, const Extension& to, Time now, Step& step);
  Status set_priority(JobId job, std::int32_t priority, Time now, Step& step);
  Status remove(JobId job, Time now, Step& step);
  /// As remove, and cancels the job first if it has not ended.
  Status discard(JobId job, Time now, std::int64_t unix_ms, Step& step);
  Status drain_worker(const std::string& name, Time now, Step& step);
  /// How the reasons of those begin whom people have put into quarantine, and nobody has found to be wrong.
  static constexpr std::string_view kByHand = "put there by ";
  /// It and all others on its machine get nothing to render until they are released; what they have is taken back, and
  /// with `render_again` all that they have had a part in. One that is there already stays, for its own reason; of one
  /// that is gone the farm must have results. `reason` begins with kByHand. NOT_FOUND.
  Status quarantine_worker(const std::string& name, const std::string& reason, bool render_again, Time now, Step& step);
  /// Somebody has asked for it in vain: jobs that have it say so while that goes on.
  void asset_is_missing(const Sha256& digest, Time now, Step& step);
  /// Ends the quarantine of this worker, and of those on its machine.
  Status release_worker(const std::string& name, Time now, Step& step);
  /// Has a worker read scene files; the answer comes in a step's `inspected`, unless it is forgotten. UNAVAILABLE,
  /// RESOURCE_EXHAUSTED.
  Result<InspectionId> inspect(const std::string& caller, InspectionRequest request, Time now, Step& step);
  void forget_inspection(InspectionId id);

  // ---- what workers do ----
  /// A stream opened and said hello. Session ids are chosen by the caller and never reused.
  void worker_connected(SessionId session, const WorkerHello& hello, Time now, Step& step);
  /// Any later message. A message of an unknown session is ignored; results of one that was replaced still count.
  void worker_message(SessionId session, WorkerMessage message, Time now, std::int64_t unix_ms, Step& step);
  /// The stream broke. Leases are kept until they expire: the worker may come back with them.
  void worker_disconnected(SessionId session, Time now, Step& step);

  /// There is more to read of workers than can be read now: what they say waits, so until they are heard again nobody
  /// is lost for having said nothing.
  void cannot_keep_up(Time now);

  /// These leases' grants stood among a step's `after_commit`, and left at `now`: from then on their workers have to do
  /// something about them. Until this is told none is lost, however long the store takes.
  void grants_sent(std::span<const LeaseId> leases, Time now);

  // ---- time ----
  /// Expires leases, ends jobs whose seconds are over, deletes those that ended long ago, hands out what became free.
  void tick(Time now, std::int64_t unix_ms, Step& step);
  /// Nothing is leased from now on, and jobs that would go on say `why`; what is out is taken when it comes. Empty: it
  /// goes on.
  void hold(const std::string& why, Time now, Step& step);
  /// When tick has something to do next, if nothing else happens.
  std::optional<Time> next_deadline() const;

  // ---- what can be seen ----
  Result<JobStatus> status(JobId job, Time now) const;
  std::vector<JobStatus> jobs(Time now, const JobFilter& filter = {}) const;  ///< newest first
  FarmCounts counts() const;
  const FarmTotals& totals() const;
  FarmCensus census() const;
  std::vector<WorkerStatus> workers(Time now, const WorkerFilter& filter = {}) const;  ///< by name
  /// How many workers the farm could use, for whoever starts and stops them: as many as have a minute's work each in
  /// what is left of all jobs, but all that are at work. A job that time alone ends wants a thread for each of its
  /// tiles; one of which nobody knows what a sample costs, or that ends within a minute, those who are there. 0 if no
  /// job goes on, 1 while nobody is there who could render one. Those in quarantine come on top, as they have a place.
  std::uint32_t wanted_workers(Time now) const;
  /// Whether that is more than 0: much sooner said.
  bool wants_workers() const;
  /// Why no work is handed out; empty while it is.
  const std::string& held() const;
  /// Valid until the next event.
  Result<const JobSpec*> spec(JobId job) const;
  /// Of all jobs.
  std::set<Sha256> assets() const;
  Result<std::string> owner(JobId job) const;
  /// The film of a job; null if there is no such job. Valid until the next event.
  const Film* film(JobId job) const;
  /// Grows with every change of the job's state or film; 0 if there is no such job.
  std::uint64_t version(JobId job) const;
  /// The same of so many jobs at most, newest first.
  std::vector<std::pair<JobId, std::uint64_t>> versions(std::size_t most) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightmill
