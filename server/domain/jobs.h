// Table of jobs: each with its record, film, plan, open audits and costs.
//
// Owns the jobs with their films, and which request made which job. The values of an ended job's film may be in the
// store alone (films.h). Takes: new jobs, stored ones, deletions. Knows nothing of workers,
// and of leases only their ids. How a job lives is in job_life_cycle.h.
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
  Time hold_until;                ///< no leases before that: workers may come back with what they hold
  bool restored = false;          ///< an earlier coordinator has stored it
  bool pictured = false;          ///< each pixel has had a sample, perhaps under an earlier coordinator
  Losses losses;
  Refusals refusals;
  PendingAudits audits;
  MeasuredCost cost;  ///< of any worker
  RateMeter rate;     ///< pixel samples
  std::uint64_t version = 1;
  mutable ErrorEstimator error;
  Time film_used;        ///< when somebody asked for its film last, or it ended
  bool reopens = false;  ///< it is done, and goes on once its film is in memory
  bool unkept = false;   ///< this coordinator has acknowledged results that the film does not have
  /// The job's place in the queue (JobQueue).
  struct Share {
    double base = 0;      ///< thread seconds that it does not count: what others had when it came
    double at_start = 0;  ///< its place when it came (again)
  } share;

  JobId id() const { return record.id; }
  /// A pilot is still to pick its method: nothing of it can be rendered.
  bool undecided() const { return !record.method_notes.candidates.empty(); }
  bool active() const { return in_progress() || record.state == JobState::paused; }
  /// Work of it is handed out: it is neither paused nor ended.
  bool in_progress() const { return record.state == JobState::queued || record.state == JobState::running; }

  // ---- film: its outline is always in memory, its values are as long as the job is active ----
  const FilmOutline& outline() const;
  bool has_film() const { return std::holds_alternative<Film>(film_); }
  Film& film();  ///< in memory (checked)
  const Film& film() const;
  void drop_node(TileId tile, SampleRange range);
  /// What was stored of it. Where values are left out, the job has ended (checked), and they are in the store alone.
  void restore_film(StoredFilm nodes);
  /// The values are in the store alone from now on. The job has ended (checked).
  void drop_film();
  /// Nodes of the outline that are not among these.
  std::vector<NodeKey> missing_from(const StoredFilm& nodes) const;
  /// The values come back from the store. None is missing (checked); what the outline does not have is left out.
  void take_film(StoredFilm nodes);
  /// Of a film that is in the store alone, as it was at the job's end; not known if the film has changed since.
  FrameError frame_error() const;

  // ---- class and method: both are fixed before its first sample ----
  const Sha256& digest() const { return digest_; }  ///< zero until then
  /// Whether the row with both is known to be stored.
  bool digest_is_durable() const { return digest_durable_; }
  /// Its results are of this class from now on; `last` is the last lease before.
  void bind(const std::string& fingerprint_class, LeaseId last);
  /// Takes the class back: nothing of the job is rendered or leased.
  void unbind();
  void choose_method(const PilotReport& report);
  /// A worker has this lease, which shows that the job's class is stored: leases of a class wait for that. A lease from
  /// before may be of the same class, which was taken back and fixed again.
  void came_back(LeaseId lease) { digest_durable_ = digest_durable_ || lease >= bound_at_; }

  // ---- leases and the time in which it is rendered ----
  const std::set<LeaseId>& leases() const { return leases_; }
  void lease_opened(LeaseId lease, Time now);
  /// The grant waits for a commit: no worker renders it yet.
  void lease_waits();
  void lease_sent(Time now);
  void lease_ended(const Lease& lease, Time now);
  double active_seconds(Time now) const {
    return record.active_seconds + (active_since_ ? to_seconds(now - *active_since_) : 0);
  }
  /// Only this share of its samples is kept: the time of the others does not count any more.
  void keep_time(double kept, Time now);
  /// Never before its method is known: its seconds are those of its picture.
  bool time_is_up(Time now) const {
    return !undecided() && record.spec.goal.seconds > 0 && active_seconds(now) >= record.spec.goal.seconds;
  }
  /// When that is so, if nothing else happens; rounded up.
  std::optional<Time> time_up_at() const;

  // ---- workers ----
  /// Class of the results that a worker of this class sends, where several are allowed (see Renderer).
  std::string class_of_result(const std::string& of_worker) const {
    return record.spec.allow_mixed ? of_worker : std::string();
  }

  // ---- samples: counts are of the frame; tiles have their parts of them (Film::frame_samples) ----
  std::uint64_t pixels_of(TileId tile) const {
    return static_cast<std::uint64_t>(outline().grid().tile_rect(tile).pixel_count());
  }
  /// No sample beyond this is ever wanted.
  std::uint64_t sample_limit() const;
  /// Up to where samples are wanted now: with a goal in error, up to the next count at which the error is read. A
  /// function of the film, and of leases beyond it, so that it need not be stored.
  std::uint64_t samples_wanted_now() const;
  std::uint64_t first_error_count() const { return lightmill::first_error_count(outline().allocation()); }
  std::uint64_t next_error_count(std::uint64_t frame) const {
    return lightmill::next_error_count(frame, first_error_count());
  }
  /// Whether the error can be read now, and is what was asked for.
  bool error_met() const;
  /// The least count that has all that is merged or leased; 0 if nothing is.
  std::uint64_t samples_end() const;
  /// What its film takes while it is active, at most.
  std::uint64_t reserved_bytes() const;
  /// Whether some tile has samples beyond ones that are missing.
  bool has_gaps() const;
  /// Adds to its history where its film has come to a count at which that is done, or, `at_end`, to any higher count.
  /// A film that has other samples in place of as many at the end gets another error. Returns whether it did.
  bool record_error(bool at_end);

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
  std::optional<Time> active_since_;  ///< while leases of it are sent; pilots do not count
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
  /// INVALID_ARGUMENT if the film of `spec` alone may outgrow the farm's limit. RESOURCE_EXHAUSTED if it may with those
  /// of all active jobs and the largest of an ended one, so that each film can be read; `instead_of`, if any, is the
  /// job whose spec it replaces.
  Status check_footprint(const JobSpec& spec, const Job* instead_of) const;

 private:
  const CoordinatorLimits& limits_;
  std::uint64_t next_id_;
  std::map<JobId, std::unique_ptr<Job>> jobs_;
  std::unordered_map<std::string, JobId> by_request_;
};

}  // namespace lightmill
