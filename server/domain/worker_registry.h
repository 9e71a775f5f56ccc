// Registry of workers: sessions, messages and results of each worker, idle workers, and identities that left recently.
//
// Owns the workers and their sessions. Takes hellos, messages, broken streams, silence, leases and their outcome. Knows
// only the ids of jobs, and the ids and sizes of leases.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/domain/event.h"
#include "server/domain/lease.h"
#include "server/domain/limits.h"
#include "server/domain/measured_cost.h"
#include "server/domain/rate_meter.h"

namespace lightmill {

/// Identity that the worker's results are attributed to: its certificate or token. If the coordinator asks for none, the
/// machine that the worker names, or its host. This separates faulty machines, not dishonest ones.
inline const std::string& identity_of(const WorkerHello& hello) {
  return !hello.identity.empty() ? hello.identity : hello.machine.empty() ? hello.host : hello.machine;
}

/// Whether both hellos are of one process. It may connect again before the coordinator notices its broken stream.
bool same_process(const WorkerHello& a, const WorkerHello& b);

/// Time over which a worker's results show what it can do: ten bins of this length.
inline constexpr Duration kDeliveryBin = std::chrono::seconds(6);

/// After this time without a bad result, an identity's count starts again at zero.
inline constexpr Duration kBadResultMemory = std::chrono::hours(1);

/// A job as one worker sees it.
struct WorkerJob {
  std::uint32_t leases = 0;
  bool describe = true;    ///< the worker may not know the job; the next lease comes with a description
  bool confirmed = false;  ///< a message of the worker shows that it got a lease of the job
  bool delivered = false;  ///< a result of an open lease came in this session, so the scene is prepared
  MeasuredCost cost = {};
  RateMeter delivered_samples{kDeliveryBin};  ///< pixel samples that it was granted, in this session
};

/// Worker that is connected or has leases.
class Worker {
 public:
  const WorkerHello& hello() const { return hello_; }  ///< without held leases
  const std::string& name() const { return hello_.name; }
  const std::string& identity() const { return identity_of(hello_); }
  /// The host, if it replaces an identity.
  std::string_view host_as_identity() const { return hello_.identity.empty() ? hello_.host : std::string_view(); }
  /// Without a class, for any job.
  Renderer renderer() const { return {hello_.name, identity_of(hello_)}; }
  const std::optional<SessionId>& session() const { return session_; }
  Time connected_at() const { return connected_at_; }
  Time last_message() const { return last_message_; }  ///< last message of this session
  Time result_at() const { return result_at_; }        ///< last result
  bool draining() const { return draining_; }
  bool quarantined() const { return quarantined_; }
  bool silent() const { return silent_; }  ///< it let a lease expire, and has sent no message since
  /// Whether its threads count for the farm: connected, and neither draining nor in quarantine.
  bool counts() const { return session_ && !draining_ && !quarantined_; }
  bool stays() const { return session_ && !draining_; }             ///< connected, and not draining
  bool may_inspect() const { return counts() && hello_.inspects; }  ///< reads scene files
  WorkerCount count() const;
  double samples_per_second(Time now) const { return rate_.per_second(now); }
  std::uint64_t results() const { return results_; }
  /// Its claim, as far as its results support it.
  std::uint32_t threads() const { return threads_; }
  std::uint64_t leases_lost() const { return leases_lost_; }

  // ---- leases ----
  const std::set<LeaseId>& leases() const { return leases_; }
  std::uint32_t tiles_out() const { return tiles_out_; }
  double unit_scale() const { return unit_scale_; }  ///< halved by a lost lease, doubled by a finished one, at most 1
  void lent(const Lease& lease);
  /// The newest lease of the farm when this worker connected, or its own newest one. The worker with the lowest id has
  /// waited longest.
  LeaseId waits_since() const { return waits_since_; }
  void waits_from(LeaseId newest) { waits_since_ = newest; }
  void tile_done() { --tiles_out_; }
  void unit_done() { unit_scale_ = std::min(unit_scale_ * 2, 1.0); }
  /// The lease ended with `lease.remaining` tiles not done.
  void ended(const Lease& lease);
  void lost(const Lease& lease, Time now);
  /// The time from which the worker may get a pilot. Each lost pilot delays it, so that none is lost again and again.
  Time pilots_from() const { return pilots_from_; }
  bool has_pilot() const { return pilots_out_ > 0; }
  void pilot_received() { pilots_lost_ = 0; }

  // ---- jobs ----
  WorkerJob& job(JobId id) { return jobs_[id]; }
  const WorkerJob* find_job(JobId id) const;
  /// Jobs that its own limits exclude, with the reasons.
  const std::map<JobId, std::string>& too_large() const { return too_large_; }
  void exclude(JobId job, std::string reason) { too_large_[job] = std::move(reason); }

  // ---- results ----
  /// The longest wait of its results for their acknowledgement, if it reported one in this session after `since`.
  std::optional<Duration> wait_since(Time since) const { return wait_at_ >= since ? wait_ : std::nullopt; }
  void waits(Duration wait, Time now);
  /// Invalid results of this process. WorkerRegistry counts those of an identity.
  std::uint32_t bad_results() const { return bad_results_; }
  std::uint32_t count_bad_result() { return ++bad_results_; }
  void count_good_result() { ++results_; }
  void rendered(JobId job, double seconds, std::uint64_t pixel_samples, Time now);

 private:
  friend class WorkerRegistry;

  WorkerHello hello_;
  std::optional<SessionId> session_;
  std::uint32_t threads_ = 0;
  std::uint64_t delivered_ = 0;  ///< granted results, in this session
  Time connected_at_, last_message_, result_at_;
  bool draining_ = false, silent_ = false, quarantined_ = false;
  std::set<LeaseId> leases_;
  LeaseId waits_since_ = {};
  std::uint32_t tiles_out_ = 0;
  double unit_scale_ = 1;
  std::uint32_t pilots_out_ = 0;
  std::uint32_t pilots_lost_ = 0;  ///< since the last pilot that came
  Time pilots_from_;
  std::map<JobId, WorkerJob> jobs_;
  std::map<JobId, std::string> too_large_;
  std::optional<Duration> wait_;
  Time wait_at_;
  RateMeter rate_;  ///< pixel samples
  std::uint64_t results_ = 0, leases_lost_ = 0, pixel_samples_ = 0;
  std::uint32_t bad_results_ = 0;
};

class WorkerRegistry {
 public:
  explicit WorkerRegistry(const CoordinatorLimits& limits) : limits_(limits) {}

  Worker* find(const std::string& name);
  const Worker* find(const std::string& name) const;
  Worker& at(const std::string& name) { return workers_.at(name); }
  std::map<std::string, Worker>& all() { return workers_; }  ///< by name
  const std::map<std::string, Worker>& all() const { return workers_; }
  std::uint64_t threads() const { return threads_; }  ///< Worker::threads() of all workers with counts()
  std::uint64_t claimed_threads() const { return claimed_threads_; }
  /// Counts a bad result of the session's worker, and of its identity. Returns the identity's count, which all its
  /// names and processes share. It restarts after kBadResultMemory without bad results.
  std::uint32_t count_bad_result(SessionId session, Time now);
  /// A result came for an open lease of the worker.
  void delivered(Worker& worker, JobId job, std::uint64_t pixel_samples, Time now);

  // ---- sessions ----
  struct Session {
    std::string worker, identity, fingerprint_class;
    bool current = true;  ///< false after the coordinator replaced or ended it: then only its results count
  };
  const Session* find_session(SessionId session) const;
  std::size_t sessions() const { return sessions_.size(); }
  /// Null unless the session is its worker's current one.
  Worker* of(SessionId session);
  /// A stream opened. The session has no worker until connect().
  void open_session(SessionId session, const WorkerHello& hello, Time now);
  bool is_full(const std::string& name) const;
  /// The worker of this name takes the session. Its earlier session must have ended. Returns whether it is another
  /// process than before.
  bool connect(SessionId session, const WorkerHello& hello, bool quarantined, Time now);
  /// The session no longer has a worker. Its results still count.
  void end_current(SessionId session);
  /// The stream ended. Returns the worker whose current session it was; else null.
  Worker* close_session(SessionId session);
  void drain(Worker& worker);
  void quarantine(Worker& worker, bool quarantined);
  /// Removes the worker if it is not connected and has no leases.
  void forget_if_gone(const std::string& name, const Event& event);
  void forget_job(JobId job);

  // ---- silence ----
  /// Returns whether the worker was silent until now.
  bool note_message(Worker& worker, bool result, Time now);
  void fell_silent(const std::string& name);
  /// Messages of workers could not be read at `now`. Until they are read again, workers do not time out.
  void note_backlog(Time now) { backlog_at_ = now; }
  Time backlog_at() const { return backlog_at_; }
  /// Current sessions that were silent for too long. Sets the time of the next check.
  std::vector<SessionId> too_silent(Time now);
  std::optional<Time> next_silence_check() const;
  /// The coordinator was stopped for `late`. Messages from this time are not read yet.
  void note_stall(Duration late, Time now);

  // ---- idle workers: they want more work than there was ----
  const std::set<std::string>& idle() const { return idle_; }
  void set_idle(const Worker& worker, bool idle);

  // ---- identities whose streams broke recently, and that may come back ----
  struct Absent {
    Time since;
    std::string fingerprint_class, renderer_version;
  };
  const std::map<std::string, Absent>& absent() const { return absent_; }
  void forget_absent(Time now);

  // ---- identities that can audit each other: of one renderer version and fingerprint class, with counts() ----
  /// Number of such identities of the worker's class.
  std::size_t identities_like(const Worker& worker) const;
  /// Whether a class of this renderer version has two such identities.
  bool any_can_audit(const std::string& renderer_version) const;

 private:
  /// Makes a change that may affect whether the worker counts.
  template <class Change>
  void change(Worker& worker, const Change& make) {
    if (worker.counts()) {
      uncount(worker);
    }
    make();
    if (worker.counts()) {
      count(worker);
    }
  }
  void count(const Worker& worker);
  void uncount(const Worker& worker);

  const CoordinatorLimits& limits_;
  std::map<std::string, Worker> workers_;
  std::unordered_map<SessionId, Session> sessions_;
  std::set<std::string> idle_;
  std::uint64_t threads_ = 0, claimed_threads_ = 0;
  /// By renderer version and class: the identities that count, with their numbers of workers.
  std::map<std::pair<std::string, std::string>, std::map<std::string, std::size_t>> classes_;
  std::map<std::string, std::size_t> audited_classes_;  ///< by renderer version: how many classes have two identities
  std::map<std::string, Absent> absent_;
  struct BadResults {
    std::uint32_t count = 0;
    Time last;
  };
  std::map<std::string, BadResults> bad_results_;  ///< by identity
  Time next_silence_check_, backlog_at_;
};

}  // namespace lightmill
