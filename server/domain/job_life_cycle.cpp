#include "server/domain/job_life_cycle.h"

#include "common/base/number_text.h"
#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

constexpr Duration kOldCheckPause = std::chrono::minutes(1);
constexpr Duration kEndingCheckInterval = std::chrono::milliseconds(500);

/// "reached 1 second", "reached 20 samples per pixel".
std::string reached(auto limit, std::string_view unit, std::string_view per = "") {
  return fmt::format("reached {} {}{}{}", limit, unit, limit == 1 ? "" : "s", per);
}

std::int64_t milliseconds(Duration duration) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

}  // namespace

// ---- states ----

void JobLifeCycle::queue_again(Job& job) {
  if (job.spec().goal.seconds > 0) {
    timed_.insert(job.id());
  }
  queue_.enter(job);
}

void JobLifeCycle::restored(Job& job, Time now) {
  if (job.state() == JobState::done && !is_whole(job)) {
    // The store left a damaged node out. It is rendered again.
    reopen(job, now);
    if (!job.awaits_film()) {
      restored_.insert(job.id());
      job.hold(now + limits_.restart_grace);
    }
  } else if (job.active()) {
    if (job.digest_is_durable()) {
      job.hold(now + limits_.restart_grace);
    }
    restored_.insert(job.id());
    queue_again(job);
  } else if (job.has_film()) {
    films_.keep(job, now);
  }
}

void JobLifeCycle::start(Job& job, const Worker& worker, const Event& event) {
  job.start(worker.hello().fingerprint_class, leases_.last_id());
  job.store(event);
  event.info(about(job.id(), worker.name()), "job {} starts on worker {}, class {}", job.id().value, worker.name(),
             job.record().fingerprint_class);
}

void JobLifeCycle::unbind_if_unwanted(Job& job, const Event& event) {
  const bool wanted = std::ranges::any_of(
      workers_.all(), [&](const auto& entry) { return entry.second.counts() && may_render(entry.second, job); });
  const bool bound = job.active() && !job.record().fingerprint_class.empty();
  if (!wanted && bound && job.leases().empty() && job.film().pixel_samples() == 0) {
    job.unbind();
    job.store(event);
  }
}

void JobLifeCycle::pause(Job& job, std::string reason, const Event& event) {
  // Results of open leases are still taken. Nothing more is leased.
  job.pause(std::move(reason));
  job.store(event);
  queue_.refresh(job);
}

void JobLifeCycle::finish(Job& job, JobState state, std::string reason, const Event& event, GoalLimit limit) {
  while (!job.leases().empty()) {
    leases_.end(*job.leases().begin(), {.cancel = true}, event);
  }
  job.end(state, limit, std::move(reason), event);
  totals_.jobs_failed += state == JobState::failed ? 1 : 0;
  films_.keep(job, event.now);
  queue_.remove(job);
  for (std::set<JobId>* const waiting : {&timed_, &restored_, &ending_}) {
    waiting->erase(job.id());
  }
  workers_.forget_job(job.id());
  job.store(event);
  const std::string& reason_given = job.record().reason;
  event.note(state == JobState::failed ? Note::Level::warning : Note::Level::info, about(job.id()), "job {} is {}{}",
             job.id().value, name_of(state), reason_given == name_of(state) ? "" : ": " + reason_given);
}

bool JobLifeCycle::complete(Job& job, GoalLimit limit, std::string reason, const Event& event) {
  if (!audits_.are_done(job, event.now)) {
    ending_.insert(job.id());
    queue_.refresh(job);
    return false;
  }
  finish(job, JobState::done, std::move(reason), event, limit);
  return true;
}

bool JobLifeCycle::fail_if_refused(Job& job, const Event& event) {
  const Refusals& refusals = job.refusals();
  const bool agreed = refusals.identities() >= limits_.refusals;
  if (refusals.empty() || (!agreed && refusals.refuted())) {
    return false;
  }
  unbind_if_unwanted(job, event);
  const bool others = audits_.any_may_render(job, event.now);
  if (agreed ? others && refusals.are_denied() : others || !refusals.certain() || !job.leases().empty()) {
    check_again(job.id());  // the other workers may leave
    return false;
  }
  finish(job, JobState::failed, job.refusals().text(), event);
  return true;
}

bool JobLifeCycle::finish_if_complete(Job& job, const Event& event) {
  if (!job.active()) {
    return true;
  }
  if (fail_if_refused(job, event)) {
    return true;
  }
  if (job.error_met()) {
    const FrameError error = job.frame_error();
    return complete(
        job, GoalLimit::error,
        fmt::format("reached relMSE {} (95%: at most {}) at {} samples per pixel", significant(error.rel_mse, 2),
                    significant(error.rel_mse + error.half_width, 2), job.film().frame_samples()),
        event);
  }
  if (job.film().frame_samples() >= job.sample_limit()) {
    return complete(job, GoalLimit::samples, reached(job.sample_limit(), "sample", " per pixel"), event);
  }
  if (job.plan().closed() && job.plan().nothing_out() && !job.plan().has_work()) {
    return complete(job, GoalLimit::seconds, reached(job.spec().goal.seconds, "second"), event);
  }
  if (!job.plan().closed() && job.film().frame_samples() >= job.plan().goal()) {
    job.plan().set_goal(job.samples_wanted_now());
    queue_.refresh(job);
  }
  return false;
}

void JobLifeCycle::close_if_time_is_up(Job& job, const Event& event) {
  if (job.active() && !job.plan().closed() && job.time_is_up(event.now)) {
    job.plan().close();
    queue_.refresh(job);
    finish_if_complete(job, event);
  }
}

void JobLifeCycle::film_loaded(Job& job, bool whole, const Event& event) {
  films_.keep(job, event.now);
  if (!whole || job.awaits_film()) {
    if (job.state() == JobState::done) {
      reopen(job, event.now);
      check_again(job.id());  // the remaining samples may be all that is wanted
    }
    job.store(event);
  }
}

void JobLifeCycle::reopen(Job& job, Time now) {
  if (!films_.use(job, now)) {
    job.await_film();
    return;
  }
  job.reopen(now);
  queue_again(job);
}

void JobLifeCycle::forget(JobId id, const Event& event) {
  ending_.erase(id);
  provenance_.forget(id);
  jobs_.remove(id, event);
}

// ---- leases ----

void JobLifeCycle::end_lease(LeaseId id, LeaseTable::End how, const Event& event) {
  Job& job = jobs_.at(leases_.at(id).unit.job);
  leases_.end(id, how, event);
  job.store_progress(event);
  finish_if_complete(job, event);
}

void JobLifeCycle::lose_lease(LeaseId id, bool cancel, const Event& event) {
  const Lease lease = leases_.at(id);
  Job& job = jobs_.at(lease.unit.job);
  leases_.end(id, {.cancel = cancel, .lost = true}, event);
  job.store_progress(event);
  // Some losses prove nothing about the work. The tiles of an audit were rendered before. An unsent lease was never
  // rendered. A worker that sends damaged results may itself be the cause.
  const Worker& worker = workers_.at(lease.worker);
  if (!lease.audits && lease.sent && worker.bad_results() == 0) {
    Losses::Blame blame = job.suspect(lease, worker.identity());
    if (blame.agreed) {
      finish(job, JobState::failed, std::move(blame.reason), event);
    } else if (!blame.reason.empty() && !job.refusals().excludes(worker.identity())) {
      event.warn(about(job.id(), worker.name()), "job {} goes to workers of other identities: {}", job.id().value,
                 blame.reason);
      job.refused(worker.identity(), "", blame.reason, Refusals::Cause::loss);
      withdraw(job, worker, event);
    }
  }
  finish_if_complete(job, event);
}

void JobLifeCycle::withdraw(Job& job, const Worker& worker, const Event& event) {
  for (const LeaseId id : std::set(job.leases())) {
    const Worker& holder = workers_.at(leases_.at(id).worker);
    if (!may_render(holder, job)) {
      leases_.end(id, {.cancel = &holder != &worker}, event);
    }
  }
  if (job.leases().empty() && job.film().pixel_samples() == 0) {
    job.keep_time(0, event.now);  // nothing was rendered in this time
  }
  job.store_progress(event);
  unbind_if_unwanted(job, event);  // the workers of its class do not render it
  finish_if_complete(job, event);
}

void JobLifeCycle::expire_leases(const Event& event) {
  while (const std::optional<LeaseId> id = leases_.next_expired(event.now)) {
    const Lease lease = leases_.at(*id);
    if (leases_.is_idle(lease, event.now)) {
      end_lease(*id, {.cancel = true, .lost = true}, event);
      leave_to_others(lease, event.now - lease.last_progress, event);
    } else {
      lose_lease(*id, true, event);
      workers_.fell_silent(lease.worker);
    }
    workers_.forget_if_gone(lease.worker, event);
  }
}

void JobLifeCycle::given_back(const Lease& lease, const Event& event) {
  Job* const job = jobs_.find(lease.unit.job);
  const Worker* const worker = workers_.find(lease.worker);
  if (job == nullptr || worker == nullptr) {
    return;
  }
  const Duration silence = job->add_silence(worker->identity(), event.now - lease.last_progress);
  if (silence >= limits_.result_timeout()) {
    leave_to_others(lease, silence, event);
  }
}

void JobLifeCycle::leave_to_others(const Lease& lost, Duration silence, const Event& event) {
  Worker* const worker = workers_.find(lost.worker);
  Job* const job = jobs_.find(lost.unit.job);
  if (worker == nullptr || job == nullptr) {
    return;
  }
  bool others = false, other_identities = false;
  for (const auto& [name, other] : workers_.all()) {
    if (name != lost.worker && other.counts() && may_render(other, *job)) {
      others = true;
      other_identities = other_identities || other.identity() != worker->identity();
    }
  }
  if (others) {
    worker->exclude(job->id(), fmt::format("no result for {:.0f} s", to_seconds(silence)));
  }
  if (other_identities) {
    job->held_in_silence(worker->identity(), event.now);
  }
  // Another identity could not render the job either, and no identity has since. The two would wait for each other
  // forever.
  const Refusals& refusals = job->refusals();
  if (!refusals.empty() && !refusals.refuted() && !refusals.excludes(worker->identity())) {
    job->refused(worker->identity(), worker->name(), fmt::format("no result for {:.0f} s", to_seconds(silence)),
                 Refusals::Cause::loss);
    withdraw(*job, *worker, event);
  }
}

// ---- time ----

void JobLifeCycle::tick(const Event& event) {
  expire_leases(event);
  for (const JobId id : std::vector(timed_.begin(), timed_.end())) {
    close_if_time_is_up(jobs_.at(id), event);
  }
  provenance_.forget_orphans(event);
  for (const JobId id : std::vector(restored_.begin(), restored_.end())) {
    if (Job& job = jobs_.at(id); event.now >= job.held_until()) {
      restored_.erase(id);
      finish_if_complete(job, event);
    }
  }
  delete_old(event);
  if (event.now >= next_ending_check_) {
    next_ending_check_ = event.now + kEndingCheckInterval;
    for (const JobId id : std::exchange(ending_, {})) {
      if (Job& job = jobs_.at(id); job.in_progress()) {  // a paused job is checked when it resumes
        finish_if_complete(job, event);
      }
    }
  }
}

void JobLifeCycle::delete_old(const Event& event) {
  if (limits_.keep_ended == Duration::zero() || event.now < next_old_check_) {
    return;
  }
  next_old_check_ = event.now + kOldCheckPause;
  for (auto at = jobs_.all().begin(); at != jobs_.all().end();) {
    const Job& job = *(at++)->second;
    const std::int64_t ago = event.unix_ms - job.record().finished_unix_ms;
    if (!job.active() && ago >= milliseconds(limits_.keep_ended)) {
      event.info(about(job.id()), "job {} is deleted: it ended {:.3g} days ago (--keep-days)", job.id().value,
                 static_cast<double>(ago) / (24.0 * 60 * 60 * 1000));
      forget(job.id(), event);
    }
  }
}

std::optional<Time> JobLifeCycle::next_deadline() const {
  std::optional<Time> next;
  const auto by = [&](Time time) { next = next ? std::min(*next, time) : time; };
  for (const JobId id : timed_) {
    if (const std::optional<Time> time_up = jobs_.at(id).time_up_at()) {
      by(*time_up);
    }
  }
  for (const JobId id : restored_) {
    by(jobs_.at(id).held_until());
  }
  if (!ending_.empty()) {
    by(next_ending_check_);
  }
  if (limits_.keep_ended > Duration::zero() && !jobs_.all().empty()) {
    by(next_old_check_);
  }
  return next;
}

}  // namespace lightmill
