// Job: its record, film, plan, leases, open audits and costs. Private to server/domain.
//
// Its methods are the events that change it. job_life_cycle.h has its states. The values of an ended job's film may be
// only in the store (films.h). Does not know workers, and knows only the ids of leases.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>

#include "common/film/error_goal.h"
#include "common/film/film.h"
#include "server/domain/event.h"
#include "server/domain/job_figures.h"
#include "server/domain/lease.h"
#include "server/domain/limits.h"
#include "server/domain/losses.h"
#include "server/domain/measured_cost.h"
#include "server/domain/pending_audits.h"
#include "server/domain/rate_meter.h"
#include "server/domain/refusals.h"
#include "server/domain/steady_rate.h"
#include "server/scheduling/job_plan.h"

namespace lightmill {

class Job {
 public:
  /// A new job, or a stored one, whose nodes restore() takes.
  Job(JobRecord record, const CoordinatorLimits& limits, Time now);
  void restore(StoredFilm nodes, Time now);

  const JobRecord& record() const { return record_; }
  const JobSpec& spec() const { return record_.spec; }
  JobId id() const { return record_.id; }
  /// Grows with every change that clients may see.
  std::uint64_t version() const { return version_; }
  void touch() { ++version_; }

  // ---- state ----
  JobState state() const { return record_.state; }
  /// No pilot has chosen the job's method yet, so nothing of the job can be rendered.
  bool undecided() const { return !record_.method_notes.candidates.empty(); }
  bool active() const { return in_progress() || state() == JobState::paused; }
  /// The job's work is leased: the job is neither paused nor ended.
  bool in_progress() const { return state() == JobState::queued || state() == JobState::running; }
  /// Gives the job its class: the one of its first worker. `last`: the farm's last lease before this.
  void start(const std::string& fingerprint_class, LeaseId last);
  /// Takes the class back. Nothing of the job is rendered or leased.
  void unbind();
  void pause(std::string reason);
  void resume();
  void set_priority(std::int32_t priority) { record_.spec.priority = priority; }
  /// If the job has ended, the caller must then reopen it.
  void extend(const Goal& goal);
  /// The job has no leases. `reached`: the limit that ended it, if any.
  void end(JobState state, GoalLimit reached, std::string reason, const Event& event);
  /// A done job is in progress again. Its film is in memory.
  void reopen(Time now);
  /// A done job is to be reopened when its film is in memory.
  void await_film() { awaits_film_ = true; }
  bool awaits_film() const { return awaits_film_; }
  /// No leases before this time: workers may come back with theirs.
  void hold(Time until) { held_until_ = until; }
  Time held_until() const { return held_until_; }
  bool restored() const { return restored_; }  ///< an earlier coordinator stored it

  // ---- parts with rules of their own ----
  JobPlan& plan() const;  ///< while it is active (checked)
  PendingAudits& audits() { return audits_; }
  const PendingAudits& audits() const { return audits_; }
  const Losses& losses() const { return losses_; }
  const Refusals& refusals() const { return refusals_; }
  /// A worker of this identity was lost with this lease, whose work may be the cause.
  Losses::Blame suspect(const Lease& lost, const std::string& identity);
  void refused(const std::string& identity, const std::string& worker, const std::string& reason,
               Refusals::Cause cause) {
    refusals_.add(identity, worker, reason, cause);
  }
  void left_to_others(const std::string& identity, Time now) { refusals_.left_to_others(identity, now); }
  void held_in_silence(const std::string& identity, Time now) { refusals_.held_in_silence(identity, now); }
  Duration add_silence(const std::string& identity, Duration time) { return refusals_.add_silence(identity, time); }

  // ---- film: its outline is always in memory, and its values while the job is active ----
  const FilmOutline& outline() const;
  bool has_film() const { return std::holds_alternative<Film>(film_); }
  const Film& film() const;  ///< in memory (checked)
  struct Merged {
    MergeOutcome outcome;
    std::uint64_t pixel_samples = 0;  ///< that the film did not have
    bool first_picture = false;       ///< each pixel has a sample now, for the first time under any coordinator
  };
  /// A result of this identity, which took a thread `seconds`.
  Merged merge(TileId tile, NodePtr node, const std::string& identity, double seconds, Time now);
  /// Drops the node that has these samples. Returns its range, or nothing if there is no such node.
  std::optional<SampleRange> drop_node(TileId tile, SampleRange within, Time now);
  /// Leaves the values only in the store. The job has ended (checked).
  void drop_film();
  /// Nodes of the outline that `nodes` does not have.
  std::vector<NodeKey> missing_from(const StoredFilm& nodes) const;
  /// Takes the values back from the store. None is missing (checked). Nodes that the outline does not have are left
  /// out.
  void take_film(StoredFilm nodes);
  /// Its film was requested, or can be dropped from now on.
  void use_film(Time now) { film_used_ = now; }
  Time film_used() const { return film_used_; }
  /// A result was acknowledged that the film does not have.
  void note_unkept_result() { unkept_ = true; }
  /// Whether this coordinator acknowledged results that the film does not have.
  bool has_unkept_results() const { return unkept_; }
  /// An audit of a result gave the same bits.
  void result_audited() { ++record_.counters.results_audited; }
  /// If the film is only in the store: its error at the job's end; unknown if the film has changed since.
  FrameError frame_error() const;

  // ---- class and method, fixed before the first sample ----
  const Sha256& digest() const { return digest_; }  ///< zero until then
  /// Whether the row with class and method is known to be stored.
  bool digest_is_durable() const { return digest_durable_; }
  /// Takes the choice of a pilot. This identity rendered it in `seconds` of thread time.
  void choose_method(const PilotReport& report, double seconds, const std::string& identity);
  /// A worker has this lease. This shows that the job's class is stored, because leases wait for that. An earlier lease
  /// proves nothing: the class may have been taken back and fixed again.
  void came_back(LeaseId lease) { digest_durable_ = digest_durable_ || lease > bound_at_; }

  // ---- leases and active time ----
  const std::set<LeaseId>& leases() const { return leases_; }
  void lease_opened(const Lease& lease, Time now);
  /// The grant waits for a commit. No worker renders it yet.
  void lease_waits() {
    if (--leases_sent_ == 0) {
      active_since_.reset();
    }
  }
  void lease_sent(Time now);
  void lease_ended(const Lease& lease, bool lost, Time now);
  double active_seconds(Time now) const {
    return record_.active_seconds + (active_since_ ? to_seconds(now - *active_since_) : 0);
  }
  /// Only the share `kept` of its samples stays. The time of the others no longer counts.
  void keep_time(double kept, Time now);
  /// Never before its method is known: the time limit is for the picture, not for pilots.
  bool time_is_up(Time now) const {
    return !undecided() && record_.spec.goal.seconds > 0 && active_seconds(now) >= record_.spec.goal.seconds;
  }
  /// When the time limit will be reached, rounded up, if no other event comes.
  std::optional<Time> time_up_at() const;

  // ---- workers ----
  /// Seconds that a worker's thread took for these samples.
  void add_cost(double seconds, std::uint64_t pixel_samples);
  const MeasuredCost& cost() const { return cost_; }  ///< of any worker
  double samples_per_second(Time now) const { return rate_.per_second(now); }
  /// Seconds until so many more pixel samples have come. Infinite if unknown.
  double seconds_for(double pixel_samples, Time now) const {
    return steady_rate_.seconds_for(pixel_samples, active_seconds(now));
  }
  /// Class for a result of a worker of this class. Empty unless the job allows several classes (see Renderer).
  std::string class_of_result(const std::string& of_worker) const {
    return record_.spec.allow_mixed ? of_worker : std::string();
  }

  // ---- samples: counts are of the frame; an allocation gives each tile its part (Film::frame_samples) ----
  std::uint64_t pixels_of(TileId tile) const {
    return static_cast<std::uint64_t>(outline().grid().tile_rect(tile).pixel_count());
  }
  /// Samples beyond this count are never wanted.
  std::uint64_t sample_limit() const;
  /// The sample count that is wanted now. With an error goal, it is the next count at which the error is read. It
  /// depends only on the film, and on leases beyond it, so it is not stored.
  std::uint64_t samples_wanted_now() const;
  std::uint64_t first_error_count() const { return lightmill::first_error_count(outline().allocation()); }
  std::uint64_t next_error_count(std::uint64_t frame) const {
    return lightmill::next_error_count(frame, first_error_count());
  }
  /// Whether the error can be read now, and meets the goal.
  bool error_met() const;
  /// Smallest count that covers all merged and leased samples; 0 if there are none.
  std::uint64_t samples_end() const;
  /// Most bytes of its film while it is active.
  std::uint64_t reserved_bytes() const { return std::max(outline().bytes(), finished_bytes(spec())); }
  /// Whether a tile has samples beyond missing ones.
  bool has_gaps() const;
  /// Adds an error to its history at certain counts, or, `at_end`, at any higher count. If the film at the end has the
  /// same count as before but other samples, replaces the last error. Returns whether the history changed.
  bool record_error(bool at_end);

  // ---- end: clients see it when it is stored ----
  /// Like state(), but before the row with the end is stored, the state before the end.
  JobState shown_state() const { return has_ended(state()) ? shown_state_ : state(); }
  /// One more row with its end is durable.
  void end_stored();

  // ---- rows ----
  void store(const Event& event);
  void store_progress(const Event& event);

 private:
  void make_plan(Time now);
  double mean_samples() const {  ///< over the film's pixels
    return static_cast<double>(outline().pixel_samples()) / static_cast<double>(outline().grid().pixel_count());
  }

  const CoordinatorLimits& limits_;
  JobRecord record_;
  std::uint64_t version_ = 1;
  Time held_until_;
  bool restored_ = false, awaits_film_ = false, unkept_ = false;
  bool pictured_ = false;  ///< each pixel had a sample, perhaps under an earlier coordinator
  std::variant<Film, FilmOutline> film_;
  Time film_used_;
  mutable ErrorEstimator error_;
  std::unique_ptr<JobPlan> plan_;  ///< while it is active
  PendingAudits audits_;
  Losses losses_;
  Refusals refusals_;
  MeasuredCost cost_;
  RateMeter rate_;          ///< pixel samples
  SteadyRate steady_rate_;  ///< pixel samples over active time
  bool digest_durable_;
  Sha256 digest_;
  LeaseId bound_at_{0};
  std::set<LeaseId> leases_;
  std::uint32_t leases_sent_ = 0;     ///< of `leases_`
  std::optional<Time> active_since_;  ///< while it has sent leases; pilots do not count
  JobState shown_state_;              ///< only if it has ended
  std::uint32_t ends_unstored_ = 0;   ///< rows that say that it has ended, and are not known to be stored
};

}  // namespace lightmill
