// Table of jobs, each with its record, film, plan, open audits and costs.
//
// Owns the jobs with their films, and the request of each job. The values of an ended job's film may be only in the
// store (films.h). Takes new jobs, stored jobs, and deletions. Does not know workers, and knows only the ids of leases.
// job_life_cycle.h has the states of a job.
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <variant>

#include "common/film/error_goal.h"
#include "common/film/film.h"
#include "server/domain/event.h"
#include "server/domain/job_rules.h"
#include "server/domain/lease.h"
#include "server/domain/limits.h"
#include "server/domain/losses.h"
#include "server/domain/measured_cost.h"
#include "server/domain/pending_audits.h"
#include "server/domain/rate_meter.h"
#include "server/domain/refusals.h"
#include "server/scheduling/job_plan.h"

namespace lightmill {

class Job {
 public:
  Job(JobRecord record, const CoordinatorLimits& limits, Time now);

  JobRecord record;
  std::unique_ptr<JobPlan> plan;  ///< while it is queued, running or paused
  Time hold_until;                ///< no leases before this time: workers may come back with theirs
  bool restored = false;          ///< an earlier coordinator stored it
  bool pictured = false;          ///< each pixel had a sample, perhaps under an earlier coordinator
  Losses losses;
  Refusals refusals;
  PendingAudits audits;
  MeasuredCost cost;  ///< of any worker
  RateMeter rate;     ///< pixel samples
  std::uint64_t version = 1;
  mutable ErrorEstimator error;
  Time film_used;        ///< last request for its film, or its end
  bool reopens = false;  ///< done, and resumes when its film is in memory
  bool unkept = false;   ///< this coordinator acknowledged results that the film does not have
  /// The job's place in the queue (JobQueue).
  struct Share {
    double base = 0;      ///< thread seconds that do not count: what other jobs had when it entered
    double at_start = 0;  ///< its place when it last entered
  } share;

  JobId id() const { return record.id; }
  /// A pilot has not chosen its method yet. Nothing of it can be rendered.
  bool undecided() const { return !record.method_notes.candidates.empty(); }
  bool active() const { return in_progress() || record.state == JobState::paused; }
  /// Its work is leased: it is neither paused nor ended.
  bool in_progress() const { return record.state == JobState::queued || record.state == JobState::running; }

  // ---- film: its outline is always in memory, and its values while the job is active ----
  const FilmOutline& outline() const;
  bool has_film() const { return std::holds_alternative<Film>(film_); }
  Film& film();  ///< in memory (checked)
  const Film& film() const;
  void drop_node(TileId tile, SampleRange range);
  /// Restores the stored nodes. If values are left out, the job has ended (checked), and they are only in the store.
  void restore_film(StoredFilm nodes);
  /// Leaves the values only in the store. The job has ended (checked).
  void drop_film();
  /// Nodes of the outline that `nodes` does not have.
  std::vector<NodeKey> missing_from(const StoredFilm& nodes) const;
  /// Takes the values back from the store. None is missing (checked). Nodes that the outline does not have are left
  /// out.
  void take_film(StoredFilm nodes);
  /// If the film is only in the store: its error at the job's end; unknown if the film has changed since.
  FrameError frame_error() const;

  // ---- class and method, fixed before the first sample ----
  const Sha256& digest() const { return digest_; }  ///< zero until then
  /// Whether the row with class and method is known to be stored.
  bool digest_is_durable() const { return digest_durable_; }
  /// Fixes the class of its results. `last`: the last lease before.
  void bind(const std::string& fingerprint_class, LeaseId last);
  /// Takes the class back. Nothing of the job is rendered or leased.
  void unbind();
  void choose_method(const PilotReport& report);
  /// A worker has this lease. This shows that the job's class is stored, because leases wait for that. An earlier lease
  /// proves nothing: the class may have been taken back and fixed again.
  void came_back(LeaseId lease) { digest_durable_ = digest_durable_ || lease >= bound_at_; }

  // ---- leases and active time ----
  const std::set<LeaseId>& leases() const { return leases_; }
  void lease_opened(LeaseId lease, Time now);
  /// The grant waits for a commit. No worker renders it yet.
  void lease_waits();
  void lease_sent(Time now);
  void lease_ended(const Lease& lease, Time now);
  double active_seconds(Time now) const {
    return record.active_seconds + (active_since_ ? to_seconds(now - *active_since_) : 0);
  }
  /// Only the share `kept` of its samples stays. The time of the others no longer counts.
  void keep_time(double kept, Time now);
  /// Never before its method is known: the time limit is for the picture, not for pilots.
  bool time_is_up(Time now) const {
    return !undecided() && record.spec.goal.seconds > 0 && active_seconds(now) >= record.spec.goal.seconds;
  }
  /// When the time will be up, rounded up, if no other event comes.
  std::optional<Time> time_up_at() const;

  // ---- workers ----
  /// Class for a result of a worker of this class. Empty unless the job allows several classes (see Renderer).
  std::string class_of_result(const std::string& of_worker) const {
    return record.spec.allow_mixed ? of_worker : std::string();
  }

  // ---- samples: counts are of the frame; an allocation gives each tile its part (Film::frame_samples) ----
  std::uint64_t pixels_of(TileId tile) const {
    return static_cast<std::uint64_t>(outline().grid().tile_rect(tile).pixel_count());
  }
  /// Samples beyond this count are never wanted.
  std::uint64_t sample_limit() const;
  /// Count up to which samples are wanted now. With an error goal, the next count at which the error is read. It
  /// depends only on the film, and on leases beyond it, so it is not stored.
  std::uint64_t samples_wanted_now() const;
  std::uint64_t first_error_count() const { return lightmill::first_error_count(outline().allocation()); }
  std::uint64_t next_error_count(std::uint64_t frame) const {
    return lightmill::next_error_count(frame, first_error_count());
  }
  /// Whether the error can be read now, and meets the goal.
  bool error_met() const;
  /// Smallest count that has all merged and leased samples; 0 if there are none.
  std::uint64_t samples_end() const;
  /// Most bytes of its film while it is active.
  std::uint64_t reserved_bytes() const;
  /// Whether a tile has samples beyond missing ones.
  bool has_gaps() const;
  /// Adds an error to its history at certain counts, or, `at_end`, at any higher count. If the film at the end has the
  /// same count as before but other samples, replaces the last error. Returns whether the history changed.
  bool record_error(bool at_end);

  // ---- end: clients see it when it is stored ----
  void end(JobState state);
  /// Like record.state, but before the row with the end is stored, the state before the end.
  JobState shown_state() const { return has_ended(record.state) ? shown_state_ : record.state; }
  /// One more row that says that it has ended is stored.
  void end_stored();

  // ---- rows ----
  void store(const Event& event);
  void store_progress(const Event& event);

 private:
  double mean_samples() const;  ///< over the film's pixels

  std::variant<Film, FilmOutline> film_;
  Sha256 digest_;
  bool digest_durable_;
  LeaseId bound_at_{0};
  std::set<LeaseId> leases_;
  std::uint32_t leases_sent_ = 0;     ///< of `leases_`
  std::optional<Time> active_since_;  ///< while it has sent leases; pilots do not count
  JobState shown_state_;              ///< only if it has ended
  std::uint32_t ends_unstored_ = 0;   ///< rows that say that it has ended, and are not known to be stored
};

class JobTable {
 public:
  JobTable(const CoordinatorLimits& limits, std::uint64_t next_id) : limits_(limits), next_id_(next_id) {}

  Job* find(JobId id) const;
  Job& at(JobId id) const { return *jobs_.at(id); }
  Result<Job*> get(JobId id) const;  ///< NOT_FOUND
  const std::map<JobId, std::unique_ptr<Job>>& all() const { return jobs_; }
  std::optional<JobId> of_request(const std::string& request_id) const;

  Job& add(const JobSpec& spec, const MethodNotes& notes, const Event& event);
  Job& restore(StoredState::StoredJob stored, Time now);
  void remove(JobId id, const Event& event);

  /// RESOURCE_EXHAUSTED if there are too many jobs, of all or of this owner.
  Status check_room(const std::string& owner) const;
  /// Checks the film of `spec` against the farm's limit. INVALID_ARGUMENT if this film alone may exceed it.
  /// RESOURCE_EXHAUSTED if it may together with those of all active jobs and the largest of an ended job. The latter
  /// must fit so that each film can be read. `instead_of`: the job whose spec it replaces, if any.
  Status check_footprint(const JobSpec& spec, const Job* instead_of) const;

 private:
  const CoordinatorLimits& limits_;
  std::uint64_t next_id_;
  std::map<JobId, std::unique_ptr<Job>> jobs_;
  std::unordered_map<std::string, JobId> by_request_;
};

}  // namespace lightmill
