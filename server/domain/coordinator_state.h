// What the coordinator holds: jobs, workers, leases, and the steps in which they change. Private to server/domain.
//
//   requests.cpp  what clients ask
//   life.cpp      jobs start, end and come back from the store
//   leasing.cpp   leases are given, settled and lost
//   inspecting.cpp workers read scene files
//   copies.cpp    those that take long are given to idle workers too
//   results.cpp   results are checked and merged
//   pilots.cpp    methods are chosen
//   verifying.cpp results are rendered again elsewhere, and who was wrong has its work undone
//   workers.cpp   sessions come, speak and go
//   view.cpp      what can be seen
//   demand.cpp    how many workers could be used
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/film/error_goal.h"
#include "common/film/film.h"
#include "server/domain/coordinator.h"
#include "server/domain/inspections.h"
#include "server/domain/job_rules.h"
#include "server/domain/notes.h"
#include "server/domain/rate_meter.h"
#include "server/domain/verification.h"
#include "server/scheduling/fair_queue.h"
#include "server/scheduling/job_plan.h"
#include "server/scheduling/results_pace.h"

namespace lightmill {

/// A running mean that follows slow changes: of the first values alike, then of the last ten or so.
class RecentMean {
 public:
  void add(double value) {
    ++count_;
    value_ += (value - value_) * std::max(1.0 / static_cast<double>(count_), 0.1);
  }
  /// The next value, which is not there yet, will be at least this.
  void expect(double value) { value_ = std::max(value_, value); }
  bool known() const { return count_ > 0 || value_ > 0; }
  double value() const { return value_; }  ///< 0 until known

 private:
  double value_ = 0;
  std::uint64_t count_ = 0;
};

/// What a costly tile costs: rises at once to what is seen, and forgets it over the next hundred or so values.
class RecentPeak {
 public:
  void add(double value) { value_ = value > value_ ? value : value_ + (value - value_) / 64; }
  double value() const { return value_; }  ///< 0 until known

 private:
  double value_ = 0;
};

struct Lease {
  LeaseId id;
  std::string worker;
  Time worker_since;       ///< when its worker had connected
  Unit unit;               ///< tiles ascending
  std::vector<bool> done;  ///< by tile of the unit: covered by the film, or not wanted from this lease any more
  std::uint32_t remaining = 0;
  Time granted;            ///< when its grant was sent
  Time deadline;           ///< lost if not renewed until then; Time::max() if never
  bool copy = false;       ///< of what another one would have had later; is not copied again
  bool abandoned = false;  ///< its worker's stream is broken
  bool alone = false;      ///< suspected: its worker has nothing else
  bool sent = true;        ///< false while its grant waits for a commit: its worker does not know of it
  SessionId waits_for;     ///< of one that is not sent: to whom its grant goes
  bool verifies = false;   ///< what it renders is in the film already
};

/// Workers that were lost with a tile, or with a job's pilot, since something of it came last.
struct Suspicion {
  std::uint32_t lost = 0;
  std::pair<std::string, Time> last;  ///< the last one, and since when it was connected: it may lose several leases
  std::vector<std::string> alone;     ///< those that had nothing else
};

/// A job as one worker sees it.
struct WorkerJob {
  std::uint32_t leases = 0;
  bool describe = true;                 ///< the worker may not know the job: the next lease goes with a description
  bool confirmed = false;               ///< a message of the worker shows that it got a lease
  RecentMean seconds_per_pixel_sample;  ///< of one thread
  RecentPeak costly_tile;               ///< the same of the costlier tiles
};

struct Worker {
  WorkerHello hello;  ///< without held leases
  std::optional<SessionId> session;
  Time connected_at;
  Time heard_at;                 ///< when a message of this session came last
  Time result_at;                ///< when a result came last
  std::optional<Duration> wait;  ///< of its results for their acknowledgement, as it said last in this session
  Time wait_at;                  ///< when it said so
  bool draining = false;
  bool silent = false;  ///< has let a lease expire and said nothing since: gets no more
  bool quarantined = false;
  std::set<LeaseId> leases;
  std::uint32_t tiles_out = 0;
  std::map<JobId, WorkerJob> jobs;
  std::map<JobId, std::string> too_large;  ///< jobs that its own limits exclude, and why
  double unit_scale = 1;                   ///< a lost lease halves it, each finished one doubles it up to 1
  RateMeter rate;                          ///< pixel samples
  std::uint64_t results = 0, leases_lost = 0, pixel_samples = 0;
  std::uint32_t bad_results = 0;
  std::uint32_t pilots_lost = 0;  ///< since it last reported one
  Time pilots_from;               ///< it gets none before that
};

/// What a worker that does not name its machine is told apart by is its host.
WorkerCount count_of(const Worker& worker);  // view.cpp

inline const std::string& machine_of(const WorkerHello& hello) {
  return hello.machine.empty() ? hello.host : hello.machine;
}
/// Of what it did for whichever job.
inline Renderer renderer_of(const WorkerHello& hello) {
  return {hello.name, machine_of(hello)};
}

struct Job {
  Job(JobRecord record, std::uint64_t budget_bytes, Time now);

  JobRecord record;
  Sha256 digest;  ///< zero until class and method are fixed
  Film film;
  std::unique_ptr<JobPlan> plan;  ///< while it is queued, running or paused
  std::set<LeaseId> leases;
  std::optional<Time> active_since;  ///< while units are out; its pilots do not count
  std::uint32_t leases_sent = 0;     ///< of `leases`: the others' grants have not left yet
  Time hold_until;                   ///< no leases before that: workers may come back with what they hold
  bool pictured = false;             ///< each pixel has had a sample; or an earlier coordinator may have seen to that
  bool digest_durable = false;       ///< the row with class and method is known to be stored
  LeaseId bound_at{0};               ///< the last lease when its class was fixed: its first one
  std::map<TileId, Suspicion> suspicions;
  Suspicion suspicion_of_pilot;
  /// Who had a part in each node of the film: indices in Coordinator::State::renderers, ascending.
  std::map<std::pair<TileId, SampleRange>, std::vector<std::uint32_t>> parts;
  Verifications verifications;
  std::uint64_t version = 1;
  double given_base = 0;                ///< for fairness: what others had when it came
  double given_at_start = 0;            ///< its place in the queue when it came (again)
  RecentMean seconds_per_pixel_sample;  ///< of one thread of any worker
  RecentPeak costly_tile;               ///< the same of the costlier tiles
  RateMeter rate;
  mutable ErrorEstimator error;

  JobId id() const { return record.id; }
  /// Its method is still to be picked by a pilot: nothing of it can be rendered.
  bool undecided() const { return !record.method_notes.candidates.empty(); }
  bool active() const {
    return record.state == JobState::queued || record.state == JobState::running || record.state == JobState::paused;
  }
  /// The class of what a worker of this class renders of it, where it may be one of several (see Renderer).
  std::string class_of_result(const std::string& of_worker) const {
    return record.spec.allow_mixed ? of_worker : std::string();
  }
  double active_seconds(Time now) const {
    return record.active_seconds + (active_since ? to_seconds(now - *active_since) : 0);
  }
  /// Leases of a class wait until it is stored, so what comes of one shows that it is; but one from before may be of
  /// the same class, which was taken back and fixed anew.
  bool bound_before(LeaseId lease) const { return lease.value >= bound_at.value; }
  // Counts below are of the frame's samples; tiles have their parts of them (Film::frame_samples).
  /// No sample beyond this is ever wanted.
  std::uint64_t sample_limit() const {
    return record.spec.goal.samples > 0 ? record.spec.goal.samples : most_samples(record.spec.goal);
  }
  std::uint64_t pixels_of(TileId tile) const {
    return static_cast<std::uint64_t>(film.grid().tile_rect(tile).pixel_count());
  }
  /// Up to where samples are wanted now: with a goal in error, up to the next count at which the error is read. A
  /// function of the film (and of what is out beyond it), so that it need not be stored.
  std::uint64_t samples_wanted_now() const;
  /// Counts at which the error is read.
  std::uint64_t first_error_count() const { return lightmill::first_error_count(film.allocation()); }
  std::uint64_t next_error_count(std::uint64_t frame) const {
    return lightmill::next_error_count(frame, first_error_count());
  }
  /// Whether the error can be read now, and is what was asked for.
  bool error_met() const;
  /// The least that has all that is merged or out; 0 if nothing is.
  std::uint64_t samples_end() const;
  /// Whether some tile has samples beyond ones that are missing.
  bool has_gaps() const;
  /// Never before its method is known: its seconds are those of its picture.
  bool time_is_up(Time now) const {
    return !undecided() && record.spec.goal.seconds > 0 && active_seconds(now) >= record.spec.goal.seconds;
  }
};

inline Renderer renderer_of(const WorkerHello& hello, const Job& job) {
  return {hello.name, machine_of(hello), job.class_of_result(hello.fingerprint_class)};
}

struct Coordinator::State {
  State(const CoordinatorLimits& limits, StoredState stored, Time now);

  // ---- life.cpp ----
  Job* find_job(JobId id);
  void start_job(Job& job, const Worker& worker, Step& step);
  /// Takes the class back of a job of which nothing is there and nothing is out: any worker may start it again.
  void unbind(Job& job, Step& step);
  void finish_job(Job& job, JobState state, std::string reason, Time now, Step& step);
  /// Ends the job if it has reached a limit. Returns whether it ended.
  bool finish_if_complete(Job& job, Time now, Step& step);
  /// Closes the plan of a job whose seconds are over.
  void close_if_time_is_up(Job& job, Time now, Step& step);
  void put_job(Job& job, Step& step);
  void forget_job(const Job& job, Step& step);
  void delete_old_jobs(Time now, Step& step);
  /// Adds to the job's history where its film has come to a count at which that is done, or, `at_end`, to any higher
  /// count. Returns whether it did.
  bool record_error(Job& job, bool at_end);
  void put_progress(Job& job, Time now, Step& step);
  /// A job that was done goes on, because its film has lost something.
  void reopen_done(Job& job, Time now);
  void queue_again(Job& job);    ///< after it was paused, ended or new: with a fresh share
  void refresh_queue(Job& job);  ///< after anything that changes what it has to give, or its place
  /// INVALID_ARGUMENT if the film of `spec` alone may outgrow the farm's limit, RESOURCE_EXHAUSTED if all films with it
  /// may; `instead_of`, if any, is the job whose spec it replaces.
  Status check_footprint(const JobSpec& spec, const Job* instead_of) const;
  std::int64_t unix_ms(Time now) const;
  void saw_clock(Time now, std::int64_t unix_milliseconds, Step& step);
  /// After standing still (stopped, suspended, out of memory): what workers have said meanwhile has yet to be read.
  void awake(Duration late, Time now, Step& step);
  std::optional<Time> next_deadline() const;
  double given_seconds(const Job& job) const;
  /// Whether its first picture is still to come, and may go before other jobs' next ones.
  bool fresh(const Job& job) const;
  Result<Job*> ended_or_not(JobId id, bool want_ended, const char* what);

  // ---- leasing.cpp ----
  void serve(Worker& worker, Time now, Step& step);
  void serve_all(Time now, Step& step);
  /// Whether its threads are the farm's.
  static bool counts(const Worker& worker) { return worker.session && !worker.draining && !worker.quarantined; }
  bool wants_more(const Worker& worker) const;
  bool may_render(const Worker& worker, const Job& job) const;
  /// Whether results of such workers would be the job's.
  static bool suits(const std::string& fingerprint_class, const std::string& renderer_version, const Job& job);
  /// The same of this one, be the job too large for it or not.
  static bool suits(const Worker& worker, const Job& job);
  /// Gives one more lease if the worker wants one and there is something for it; keeps `idle` up to date.
  bool serve_once(Worker& worker, Time now, Step& step);
  /// Of a result of a whole tile, at most.
  static double node_bytes(const Job& job);
  /// Whether as much of the job is out as may be before anything of it is back.
  bool enough_is_tried(const Job& job) const;
  UnitAim aim_for(const Worker& worker, const Job& job, Time now) const;
  Lease& open_lease(Worker& worker, Job& job, LeaseId id, Unit unit, bool copy, Time now);
  void send_grant(Worker& worker, Job& job, Lease& lease, Step& step);
  void wait_until_sent(const Worker& worker, Job& job, Lease& lease);
  void was_sent(Lease& lease, Time now);
  bool grant_next(Worker& worker, Time now, Step& step);
  /// The tile needs nothing more of this lease.
  void tile_done(LeaseId lease, TileId tile, Time now, Step& step, bool by_its_worker);
  /// Takes what remains of a lease back. `cancel`: tells the worker; `lost`: counts it.
  void end_lease(LeaseId lease, bool cancel, bool lost, Time now, Step& step);
  /// The same of one that is lost because its worker is not heard of any more: what it was to render may be why.
  void end_lease_of_lost(LeaseId lease, bool cancel, Time now, Step& step);
  /// Empty, or why a job is to fail whose tile or pilot workers were lost with again and again.
  std::string suspect(Job& job, const Lease& lost) const;
  bool is_suspect(const Suspicion& suspicion) const { return suspicion.lost >= limits.losses_before_alone; }
  void settle(Job& job, const NodeKey& merged, std::optional<LeaseId> from, Time now, Step& step);
  void renew(Lease& lease, Time now);
  void set_deadline(Lease& lease, Time deadline);
  void expire(Time now, Step& step);
  LeaseId next_lease_id() { return LeaseId{epoch << 32 | ++lease_count}; }
  Worker* find_worker(const std::string& name);

  // ---- copies.cpp ----
  bool may_copy() const { return held.empty() && !idle.empty() && !leases.empty(); }
  void copy_to_idle(Time now, Step& step);
  /// Of one thread of the worker, for one tile of the lease: as measured, or as it is for others.
  double tile_seconds(const Worker& worker, const Lease& lease) const;
  /// Until the lease's own worker will have done it, all that it has before that included.
  double seconds_left(const Lease& lease, Time now) const;
  /// Somebody else had a tile of this lease sooner: its worker is at least as slow as it has been silent.
  void note_silence(Worker& worker, const Lease& lease, Time now) const;
  /// Leases to the worker, too, what is still to be done of `lease`, or the end of it. Whether there was something.
  bool copy_lease(const Lease& lease, Worker& worker, Time now, Step& step);
  /// The worker, and no longer the lease's own, verifies some of it. Whether there was something that it may.
  bool take_over_verification(const Lease& lease, Worker& worker, Time now, Step& step);

  // ---- pilots.cpp ----
  bool may_pilot(const Worker& worker, const Job& job, Time now) const;
  void grant_pilot(Worker& worker, Job& job, Time now, Step& step);
  void on_pilot(Worker& worker, const PilotReport& report, Time now, Step& step);
  /// After a pilot that was lost: the worker must not get it, lose it and get it again without end.
  void hold_pilots_back(Worker& worker, Time now) const;

  // ---- inspecting.cpp ----
  static bool may_inspect(const Worker& worker) { return counts(worker) && worker.hello.inspects; }
  void serve_inspections(Time now, Step& step);

  // ---- results.cpp ----
  void on_result(SessionId session, WorkerResult result, Time now, Step& step);
  Status check_result(const Job& job, const WorkerResult& result) const;
  void reject_result(SessionId session, const WorkerResult& result, const Status& error, Time now, Step& step);
  /// Takes back the lease of a message that cannot be true, if the session's worker has it, and counts the message.
  void distrust(SessionId session, LeaseId lease, const Status& error, Time now, Step& step);
  void merge_result(Job& job, const Renderer& by, WorkerResult result, Time now, Step& step);

  // ---- verifying.cpp ----
  void restore_results(Job& job, const StoredState& stored, const std::vector<StoredState::StoredResult>& results);
  void forget_orphans(Step& step);
  std::uint32_t renderer_index(const Renderer& renderer);
  bool grant_verification(Worker& worker, Job& job, Time now, Step& step);
  /// What `outcome` of merging this result means for who had a part in which node.
  void note_parts(Job& job, const NodeKey& key, const Renderer& by, const MergeOutcome& outcome);
  /// A result of samples that the film has: it may be what a verification waits for.
  void compare_result(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, bool differs, Time now,
                      Step& step);
  /// The lease is done with this tile, which it had to verify.
  void end_verification_of(LeaseId lease, TileId tile, Time now, Step& step);
  /// Two machines have said `hash` of these samples.
  void settle_verification(Job& job, const NodeKey& key, const Hash128& hash, Time now, Step& step);
  void accuse_program(Job& job, const NodeKey& key, Time now, Step& step);
  void convict(const Renderer& guilty, const Job& job, const NodeKey& key, std::span<const Claim> agreed, Time now,
               Step& step);
  void put_in_quarantine(const Renderer& guilty, const std::string& reason, Time now, Step& step);
  /// Workers that nothing holds in quarantine any more go on.
  void let_go(Time now, Step& step);
  /// What it has had a part in is rendered again.
  void undo_work_of(const Renderer& guilty, Time now, Step& step);
  /// Takes out the film's node that contains these samples, and all that is known of it.
  void drop_node_with(Job& job, TileId tile, SampleRange range, Time now, Step& step);
  /// Of a job with a goal in seconds, when only a share of its samples is kept: what the others took counts no more.
  void give_back_seconds(Job& job, double kept, Time now);
  bool in_quarantine(const Renderer& renderer) const;
  std::string reason_for_quarantine(const Renderer& renderer) const;
  void hold_in_quarantine(Worker& worker, const std::string& reason, Time now, Step& step);
  /// Who is here, or was lately, and may render the job: machines and classes, without names.
  std::vector<Renderer> renderers_for(const Job& job, Time now) const;
  /// What the film holds there, as a claim; nothing if the job is mixed and no worker of `by`'s class alone rendered
  /// it.
  std::optional<Claim> claim_of_film(const Job& job, const NodeKey& key, const Renderer& by) const;
  /// Whether nothing of the job is left to be verified by anybody who is there or was lately.
  bool verified_as_far_as_possible(const Job& job, Time now) const;
  /// Empty, or which samples two machines differ about while no third one is there.
  std::string reason_for_dispute(const Job& job) const;

  // ---- workers.cpp ----
  void connect(SessionId session, const WorkerHello& hello, Time now, Step& step);
  void take_back_held(Worker& worker, const WorkerHello& hello, bool other_process, Time now, Step& step);
  bool adopt_held(Worker& worker, const HeldLease& held, Time now, Step& step);
  void on_return(Worker& worker, const WorkerReturn& message, Time now, Step& step);
  void on_refusal(Worker& worker, const WorkerRefusal& refusal, Time now, Step& step);
  /// It renders nothing of the job any more; others may.
  void exclude(Worker& worker, Job& job, const std::string& reason, Time now, Step& step);
  /// `for_now`: for want of room.
  void dismiss(SessionId session, std::string reason, Time now, Step& step, bool for_now = false);
  /// What the worker was reading waits for another one: serve_inspections.
  void end_session(SessionId session, Time now, Step& step);
  void forget_if_gone(const std::string& name, Step& step);
  Worker* worker_of(SessionId session);  ///< null unless the session is the worker's current one

  // ---- heartbeats.cpp ----
  Duration heartbeat_interval() const;  ///< for who comes now: the more are there, the longer
  void on_heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, Time now, Step& step);
  /// Whether workers' results wait too long for their acknowledgement.
  void look_at_waits(Time now, Step& step);
  /// Ends the sessions of workers that have been silent for too long.
  void hang_up_on_silent(Time now, Step& step);

  // ---- view.cpp ----
  JobStatus describe(const Job& job, Time now) const;
  std::string reason_to_wait(const Job& job, Time now) const;  ///< empty if somebody is there who may render it
  std::string reason_of_missing(const Job& job, Time now) const;
  bool somebody_may_render(const Job& job) const;  ///< of those that are there
  std::string why_nobody(const Job& job) const;

  // ---- demand.cpp ----
  std::uint32_t wanted_workers(Time now) const;
  bool wants_workers() const;

  CoordinatorLimits limits;
  std::uint64_t epoch;
  std::uint64_t next_job_id;
  std::uint64_t lease_count = 0;
  std::map<Sha256, Time> missing_assets;  ///< and when they were last asked for
  std::string held;                       ///< why nothing is leased; empty: it is
  Time next_old_look;                     ///< for jobs that ended long ago

  std::map<JobId, std::unique_ptr<Job>> jobs;
  std::unordered_map<std::string, JobId> by_request;
  std::set<JobId> timed_jobs;     ///< active and with a goal in seconds
  std::set<JobId> restored_jobs;  ///< to be looked at by the first tick, or held back until their time
  std::vector<NodeKey> orphans;   ///< recorded results without their samples: forgotten with the next step
  FairQueue queue;
  FarmTotals totals;

  std::map<std::string, Worker> workers;  ///< by name; also gone ones while leases are in their name
  struct Session {
    std::string worker;
    std::string machine;
    std::string fingerprint_class;
    bool current = true;  ///< false once replaced or dismissed: only results count
  };
  std::unordered_map<SessionId, Session> sessions;
  std::set<std::string> idle;  ///< workers that wanted more than there was
  std::uint64_t farm_threads = 0;
  std::map<std::string, QuarantineRecord> quarantine;  ///< by worker
  std::vector<Renderer> renderers;                     ///< all that had a part in some film
  std::map<Renderer, std::uint32_t> renderer_indices;
  Sha256 secret;
  /// Machines whose workers' streams broke lately: they may come back.
  struct Absent {
    Time since;
    std::string fingerprint_class, renderer_version;
  };
  std::map<std::string, Absent> absent;
  Time started;
  std::set<std::string> machines_before;  ///< those that an earlier coordinator had results of
  std::set<JobId> ending;                 ///< jobs of which each tick asks whether they are complete
  Time next_ending_look;

  std::unordered_map<LeaseId, Lease> leases;
  std::set<std::pair<Time, LeaseId>> expiry;
  Time next_copy_look, next_silence_look;
  Time next_full_note{};  ///< when it may be said again that there is no room
  ResultsPace pace;
  bool slowed = false;         ///< somebody has been told that the pace is low
  Time behind_at;              ///< when workers could not all be heard, the last time
  std::string last_copied_to;  ///< or the last worker for which there was nothing: the next look begins behind it

  Inspections inspections{epoch << 32 | 1};  ///< whose numbers no other coordinator has given

  Time clock_time;
  std::int64_t clock_unix_ms = 0;
};

inline void send(Step& step, SessionId to, CoordinatorMessage message) {
  step.now.push_back({to, std::move(message)});
}
inline void send_after_commit(Step& step, SessionId to, CoordinatorMessage message) {
  step.after_commit.push_back({to, std::move(message)});
}

}  // namespace lightmill
