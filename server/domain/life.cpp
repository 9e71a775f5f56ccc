// How jobs start, end and come back from the store.
#include "common/base/check.h"
#include "server/domain/coordinator_state.h"
#include "server/domain/job_rules.h"

namespace lightmill {
namespace {

/// How much of the whole farm's time, in units, a job's first picture may have before others get their share.
constexpr double kFreshUnits = 2;
constexpr Duration kOldLookPause = std::chrono::minutes(1);

double gib(std::uint64_t bytes) {
  return static_cast<double>(bytes) / static_cast<double>(std::uint64_t{1} << 30);
}

/// "reached 1 second", "reached 20 samples per pixel".
std::string reached(auto limit, std::string_view unit, std::string_view per = "") {
  return fmt::format("reached {} {}{}{}", limit, unit, limit == 1 ? "" : "s", per);
}

}  // namespace

Job::Job(JobRecord from, std::uint64_t budget_bytes, Time now)
    : record(std::move(from)),
      film(grid_of(record.spec.settings), NodeLayout(record.spec.settings.layers), record.allocation),
      hold_until(now) {
  if (!record.fingerprint_class.empty() && !undecided()) {
    digest = render_digest(record.spec.settings, record.fingerprint_class);
  }
  if (active()) {
    plan = std::make_unique<JobPlan>(film, samples_wanted_now(), budget_bytes);
  }
}

std::uint64_t Job::samples_end() const {
  std::uint64_t end = plan ? plan->out_end() : 0;
  for (std::uint32_t tile = 0; tile < film.grid().tile_count(); ++tile) {
    const std::vector<NodePtr>& forest = film.forest(TileId{tile});
    end = std::max(end, film.allocation().frame_for(TileId{tile}, forest.empty() ? 0 : forest.back()->range.end()));
  }
  return end;
}

bool Job::has_gaps() const {
  for (std::uint32_t tile = 0; tile < film.grid().tile_count(); ++tile) {
    const std::vector<NodePtr>& forest = film.forest(TileId{tile});
    if (!forest.empty() && forest.back()->range.end() != film.samples(TileId{tile})) {
      return true;
    }
  }
  return false;
}

bool Job::error_met() const {
  const double goal = record.spec.goal.error;
  return goal > 0 && next_error_count(film.frame_samples()) == film.frame_samples() &&
         film.has_just(film.frame_samples()) && !has_gaps() && meets(error.update_all(film), goal);
}

std::uint64_t Job::samples_wanted_now() const {
  if (record.spec.goal.error == 0) {
    return sample_limit();
  }
  std::uint64_t count = next_error_count(samples_end());
  if (film.frame_samples() == count && !error_met()) {
    count = next_error_count(count + 1);
  }
  return std::min(count, sample_limit());
}

Coordinator::State::State(const CoordinatorLimits& the_limits, StoredState stored, Time now)
    : limits(the_limits),
      epoch(stored.epoch),
      next_job_id(stored.next_job_id),
      secret(stored.secret),
      started(now),
      pace(limits.result_bytes_per_second, now) {
  LM_CHECK(epoch > 0 && epoch < std::uint64_t{1} << 32);
  for (QuarantineRecord& record : stored.quarantine) {
    quarantine[record.of.worker] = std::move(record);
  }
  for (StoredState::StoredJob& stored_job : stored.jobs) {
    auto job = std::make_unique<Job>(std::move(stored_job.record), limits.film_bytes_per_job, now);
    for (StoredState::StoredNode& stored_node : stored_job.nodes) {
      LM_CHECK(stored_node.tile.value < job->film.grid().tile_count(), "job {} has a stored node of tile {} of {}",
               job->id().value, stored_node.tile.value, job->film.grid().tile_count());
      job->film.restore(stored_node.tile, std::move(stored_node.node));
    }
    job->pictured = job->film.min_samples() > 0 || job->record.counters.results_merged > 0;
    const JobId id = job->id();
    restore_results(*job, stored, stored_job.results);
    by_request[job->record.spec.request_id] = id;
    job->digest_durable = !job->record.fingerprint_class.empty() && !job->undecided();
    Job& at = *jobs.emplace(id, std::move(job)).first->second;
    if (at.record.state == JobState::done && !is_whole(at)) {
      // A damaged node was left out by the store: it is rendered again.
      restored_jobs.insert(id);
      reopen_done(at, now);
      at.hold_until = now + limits.restart_grace;
    } else if (at.active()) {
      if (at.digest_durable) {
        at.hold_until = now + limits.restart_grace;
      }
      at.plan = std::make_unique<JobPlan>(at.film, at.samples_wanted_now(), limits.film_bytes_per_job);
      if (at.time_is_up(now)) {
        at.plan->close();
      }
      restored_jobs.insert(id);
      queue_again(at);
    }
  }
}

Job* Coordinator::State::find_job(JobId id) {
  const auto found = jobs.find(id);
  return found == jobs.end() ? nullptr : found->second.get();
}

Result<Job*> Coordinator::State::ended_or_not(JobId id, bool want_ended, const char* what) {
  Job* job = find_job(id);
  if (job == nullptr) {
    return not_found("there is no job {}", id.value);
  }
  if (job->active() == want_ended) {
    return failed_precondition("job {} cannot be {}: it is {}", id.value, what, name_of(job->record.state));
  }
  return job;
}

void Coordinator::State::saw_clock(Time now, std::int64_t unix_milliseconds, Step& step) {
  if (const std::optional<Time> due = next_deadline();
      due && now - std::max(*due, clock_time) > limits.lease_duration / 2) {
    awake(now - std::max(*due, clock_time), now, step);
  }
  clock_time = now;
  clock_unix_ms = unix_milliseconds;
}

void Coordinator::State::awake(Duration late, Time now, Step& step) {
  note(step, Note::Level::warning, Subject{},
       "the coordinator has stood still, and was {:.0f} s late: workers get as long again", to_seconds(late));
  for (auto& [id, lease] : leases) {
    set_deadline(lease,
                 std::max(lease.deadline, now + (lease.abandoned ? limits.disconnect_grace : limits.lease_duration)));
  }
  for (auto& [name, worker] : workers) {
    worker.heard_at = now;
  }
  for (auto& [machine, was] : absent) {
    was.since += late;
  }
  started += late;
  next_silence_look = now + limits.silence;
  pace.stood_still(now);
}

std::int64_t Coordinator::State::unix_ms(Time now) const {
  return clock_unix_ms + std::chrono::duration_cast<std::chrono::milliseconds>(now - clock_time).count();
}

void Coordinator::State::put_job(Job& job, Step& step) {
  ++job.version;
  step.writes.push_back(PutJob{job.record});
}

bool Coordinator::State::record_error(Job& job, bool at_end) {
  std::vector<ErrorPoint>& history = job.record.history;
  const double samples =
      static_cast<double>(job.film.pixel_samples()) / static_cast<double>(job.film.grid().pixel_count());
  const double last = history.empty() ? 0 : history.back().samples;
  constexpr double kRounding = 1e-6;  // the frame's counts are whole
  const std::uint64_t next =
      job.next_error_count(static_cast<std::uint64_t>(last / job.film.mean_share() + kRounding) + 1);
  if (samples <= last || (!at_end && job.film.frame_samples() < next)) {
    return false;
  }
  const FrameError error = job.error.update(job.film);
  const bool known = error.known && has_error(job.record.spec);
  if (known) {
    history.push_back({samples, job.record.worker_seconds, error.rel_mse, error.half_width});
  }
  return known;
}

void Coordinator::State::put_progress(Job& job, Time now, Step& step) {
  ++job.version;
  step.writes.push_back(PutProgress{job.id(), job.active_seconds(now), job.record.worker_seconds, job.record.counters});
}

void Coordinator::State::forget_job(const Job& job, Step& step) {
  const JobId id = job.id();
  by_request.erase(job.record.spec.request_id);
  ending.erase(id);
  jobs.erase(id);
  step.writes.push_back(DeleteJobRows{id});
}

void Coordinator::State::delete_old_jobs(Time now, Step& step) {
  if (limits.keep_ended == Duration::zero() || now < next_old_look) {
    return;
  }
  next_old_look = now + kOldLookPause;
  const std::int64_t ended_before =
      unix_ms(now) - std::chrono::duration_cast<std::chrono::milliseconds>(limits.keep_ended).count();
  for (auto at = jobs.begin(); at != jobs.end();) {
    const Job& job = *(at++)->second;
    if (!job.active() && job.record.finished_unix_ms <= ended_before) {
      note(step, Note::Level::info, about(job.id()), "job {} is deleted: it ended {:.3g} days ago (--keep-days)",
           job.id().value, static_cast<double>(unix_ms(now) - job.record.finished_unix_ms) / (24.0 * 60 * 60 * 1000));
      forget_job(job, step);
    }
  }
}

double Coordinator::State::given_seconds(const Job& job) const {
  const double out = job.plan ? static_cast<double>(job.plan->out_pixel_samples()) : 0;
  return job.record.worker_seconds + out * job.seconds_per_pixel_sample.value() - job.given_base;
}

bool Coordinator::State::fresh(const Job& job) const {
  // Bounded, lest a huge film's first picture hold up all that others have still to refine.
  const double head_start =
      kFreshUnits * limits.unit_seconds * static_cast<double>(std::max<std::uint64_t>(farm_threads, 1));
  return job.plan->first_round() && given_seconds(job) - job.given_at_start < head_start;
}

void Coordinator::State::queue_again(Job& job) {
  job.given_base = 0;
  job.given_at_start = queue.starting_seconds(job.record.spec.priority);
  job.given_base = given_seconds(job) - job.given_at_start;
  if (job.record.spec.goal.seconds > 0) {
    timed_jobs.insert(job.id());
  }
  refresh_queue(job);
}

void Coordinator::State::reopen_done(Job& job, Time now) {
  job.record.state = JobState::running;
  job.record.reason.clear();
  job.record.reached = GoalLimit::none;
  job.record.finished_unix_ms = 0;
  job.plan = std::make_unique<JobPlan>(job.film, job.samples_wanted_now(), limits.film_bytes_per_job);
  if (job.time_is_up(now)) {
    job.plan->close();
  }
  queue_again(job);
}

void Coordinator::State::refresh_queue(Job& job) {
  const bool leasable = job.record.state == JobState::queued || job.record.state == JobState::running;
  if (leasable && (job.plan->has_work() || job.verifications.waiting())) {
    queue.put(job.id(), {job.record.spec.priority, fresh(job), given_seconds(job)});
  } else {
    queue.remove(job.id());
  }
}

void Coordinator::State::start_job(Job& job, const Worker& worker, Step& step) {
  job.record.fingerprint_class = job.record.spec.allow_mixed ? kMixedClass : worker.hello.fingerprint_class;
  job.bound_at = LeaseId{epoch << 32 | lease_count};
  if (!job.undecided()) {
    job.digest = render_digest(job.record.spec.settings, job.record.fingerprint_class);
  }
  job.record.state = JobState::running;
  put_job(job, step);
  note(step, Note::Level::info, about(job.id(), worker.hello.name), "job {} starts on worker {}, class {}",
       job.id().value, worker.hello.name, job.record.fingerprint_class);
}

void Coordinator::State::unbind(Job& job, Step& step) {
  job.record.fingerprint_class.clear();
  job.record.state = JobState::queued;
  job.digest = {};
  job.digest_durable = false;
  put_job(job, step);
}

void Coordinator::State::finish_job(Job& job, JobState state, std::string reason, Time now, Step& step) {
  while (!job.leases.empty()) {
    end_lease(*job.leases.begin(), true, false, now, step);
  }
  record_error(job, true);
  job.record.state = state;
  totals.jobs_failed += state == JobState::failed ? 1 : 0;
  job.record.reason = std::move(reason);
  job.record.finished_unix_ms = unix_ms(now);
  job.plan.reset();
  job.suspicions.clear();
  job.suspicion_of_pilot = {};
  if (state != JobState::done) {
    job.verifications = {};  // what a done job lacks it may still get, when it is extended
  }
  ending.erase(job.id());
  queue.remove(job.id());
  timed_jobs.erase(job.id());
  restored_jobs.erase(job.id());
  for (auto& [name, worker] : workers) {
    worker.jobs.erase(job.id());
    worker.too_large.erase(job.id());
  }
  put_job(job, step);
  note(step, state == JobState::failed ? Note::Level::warning : Note::Level::info, about(job.id()), "job {} is {}: {}",
       job.id().value, name_of(state), job.record.reason);
}

bool Coordinator::State::finish_if_complete(Job& job, Time now, Step& step) {
  if (!job.active()) {
    return true;
  }
  const auto done = [&](GoalLimit limit, std::string reason) {
    if (!verified_as_far_as_possible(job, now)) {
      ending.insert(job.id());
      refresh_queue(job);
      return false;
    }
    job.record.reached = limit;
    finish_job(job, JobState::done, std::move(reason), now, step);
    return true;
  };
  if (job.error_met()) {
    const FrameError error = job.error.update_all(job.film);
    return done(GoalLimit::error,
                fmt::format("reached relMSE {} at {} samples per pixel", interval_text(error.rel_mse, error.half_width),
                            job.film.frame_samples()));
  }
  if (job.film.frame_samples() >= job.sample_limit()) {
    return done(GoalLimit::samples, reached(job.sample_limit(), "sample", " per pixel"));
  }
  if (job.plan->closed() && job.plan->nothing_out() && !job.plan->has_work()) {
    return done(GoalLimit::seconds, reached(job.record.spec.goal.seconds, "second"));
  }
  if (!job.plan->closed() && job.film.frame_samples() >= job.plan->goal()) {
    job.plan->set_goal(job.samples_wanted_now());
    refresh_queue(job);
  }
  return false;
}

void Coordinator::State::close_if_time_is_up(Job& job, Time now, Step& step) {
  if (job.active() && !job.plan->closed() && job.time_is_up(now)) {
    job.plan->close();
    refresh_queue(job);
    finish_if_complete(job, now, step);
  }
}

Status Coordinator::State::check_footprint(const JobSpec& spec, const Job* instead_of) const {
  const std::uint64_t own = finished_bytes(spec);
  if (own > limits.film_bytes) {
    return invalid_argument("the film may come to hold {:.4g} GiB, more than --films-gib {:.4g} of the server allows",
                            gib(own), gib(limits.film_bytes));
  }
  std::uint64_t all = own;
  for (const auto& [id, job] : jobs) {
    if (job.get() != instead_of) {
      all += job->active() ? std::max(job->film.bytes(), finished_bytes(job->record.spec)) : job->film.bytes();
    }
  }
  if (all > limits.film_bytes) {
    return resource_exhausted(
        "the films of all jobs may come to hold {:.4g} GiB, more than --films-gib {:.4g} of the server allows: delete "
        "jobs that have ended",
        gib(all), gib(limits.film_bytes));
  }
  return ok_status();
}

// ---- the class ----

Coordinator::Coordinator(const CoordinatorLimits& limits, StoredState state, Time now)
    : state_(std::make_unique<State>(limits, std::move(state), now)) {
  state_->clock_time = now;
}
Coordinator::~Coordinator() = default;

}  // namespace lightmill
