// Time, and what can be seen of a coordinator.
#include "server/domain/coordinator_state.h"
#include "server/domain/job_rules.h"

namespace lightmill {
namespace {

constexpr Duration kEndingLookInterval = std::chrono::milliseconds(500);

/// Workers ask again sooner.
constexpr Duration kMissingPatience = std::chrono::seconds(5);

bool record_is_waiting(JobState state) {
  return state == JobState::queued || state == JobState::running;
}

}  // namespace

void Coordinator::tick(Time now, std::int64_t unix_ms, Step& step) {
  State& state = *state_;
  state.saw_clock(now, unix_ms, step);
  state.expire(now, step);
  const std::vector<JobId> timed(state.timed_jobs.begin(), state.timed_jobs.end());
  for (const JobId id : timed) {
    if (Job* const job = state.find_job(id)) {
      state.close_if_time_is_up(*job, now, step);
    }
  }
  state.forget_orphans(step);
  // Jobs of an earlier coordinator may be complete, or may be leased from now on.
  const std::vector<JobId> restored(state.restored_jobs.begin(), state.restored_jobs.end());
  for (const JobId id : restored) {
    Job* const job = state.find_job(id);
    if (job == nullptr || now >= job->hold_until) {
      state.restored_jobs.erase(id);
      if (job != nullptr) {
        state.finish_if_complete(*job, now, step);
      }
    }
  }
  state.delete_old_jobs(now, step);
  std::erase_if(state.absent,
                [&](const auto& entry) { return now >= entry.second.since + state.limits.verifier_patience; });
  for (const JobId id : std::exchange(state.ending, {})) {
    if (Job* const job = state.find_job(id)) {
      state.finish_if_complete(*job, now, step);
    }
  }
  state.next_ending_look = now + kEndingLookInterval;
  state.serve_all(now, step);
  if (state.may_copy() && now >= state.next_copy_look) {
    state.copy_to_idle(now, step);
  }
  if (!state.sessions.empty() && now >= state.next_silence_look) {
    state.hang_up_on_silent(now, step);
  }
  state.inspections.tick(now, step);
  state.serve_inspections(now, step);
}

std::optional<Time> Coordinator::next_deadline() const {
  return state_->next_deadline();
}

std::optional<Time> Coordinator::State::next_deadline() const {
  std::optional<Time> next;
  const auto by = [&](Time time) { next = next ? std::min(*next, time) : time; };
  if (!expiry.empty()) {
    by(expiry.begin()->first);
  }
  for (const JobId id : timed_jobs) {
    const Job& job = *jobs.at(id);
    if (job.active_since && !job.plan->closed()) {
      // Rounded up: a tick must not come a nanosecond early.
      by(*job.active_since + from_seconds(std::max(job.record.spec.goal.seconds - job.record.active_seconds, 0.0)) +
         std::chrono::microseconds(1));
    }
  }
  for (const JobId id : restored_jobs) {
    by(jobs.at(id)->hold_until);
  }
  if (!ending.empty()) {
    by(next_ending_look);
  }
  if (may_copy()) {
    by(next_copy_look);
  }
  if (!sessions.empty()) {
    by(next_silence_look);
  }
  if (const std::optional<Time> inspection = inspections.next_deadline()) {
    by(*inspection);
  }
  if (limits.keep_ended > Duration::zero() && !jobs.empty()) {
    by(next_old_look);
  }
  return next;
}

std::string Coordinator::State::reason_to_wait(const Job& job, Time now) const {
  if (!record_is_waiting(job.record.state)) {
    return "";
  }
  if (!held.empty()) {
    return held;
  }
  if (std::string reason = reason_of_missing(job, now); !reason.empty()) {
    return reason;
  }
  if (!job.verifications.disputed().empty()) {
    if (std::string reason = reason_for_dispute(job); !reason.empty()) {
      return reason;
    }
  }
  return job.leases.empty() && !somebody_may_render(job) ? why_nobody(job) : "";
}

std::string Coordinator::State::reason_of_missing(const Job& job, Time now) const {
  if (missing_assets.empty()) {
    return "";
  }
  for (const Sha256& asset : job.record.spec.settings.assets) {
    if (const auto missing = missing_assets.find(asset);
        missing != missing_assets.end() && now - missing->second < kMissingPatience) {
      return fmt::format("waits for a file that was lost ({}): submit the same scene again, which sends it",
                         asset.hex().substr(0, 12));
    }
  }
  return "";
}

bool Coordinator::State::somebody_may_render(const Job& job) const {
  return std::ranges::any_of(workers, [&](const auto& entry) {
    return entry.second.session && !entry.second.draining && may_render(entry.second, job);
  });
}

/// Those that are there and cannot render it now, by what keeps them from it: what people can change comes first.
std::string Coordinator::State::why_nobody(const Job& job) const {
  std::vector<std::string> in_quarantine, leaving, too_small, of_others;
  for (const auto& [name, worker] : workers) {
    if (!worker.session) {
      continue;
    }
    const auto too_large = worker.too_large.find(job.id());
    const std::string& version = worker.hello.renderer_version;
    if (!suits(worker.hello.fingerprint_class, version, job)) {
      of_others.push_back(version != job.record.spec.settings.renderer_version
                              ? fmt::format("{} has renderer {}", name, version)
                              : fmt::format("{} is of class {}", name, worker.hello.fingerprint_class));
    } else if (too_large != worker.too_large.end()) {
      too_small.push_back(fmt::format("for {} {}", name, too_large->second));
    } else if (worker.quarantined) {
      in_quarantine.push_back(name);
    } else {
      leaving.push_back(name);
    }
  }
  const auto some = [](const std::vector<std::string>& names) {
    return names.size() == 1 ? fmt::format("{} is", names[0])
                             : fmt::format("{} and {} more are", names[0], names.size() - 1);
  };
  std::vector<std::string> reasons;
  if (!in_quarantine.empty()) {
    reasons.push_back(fmt::format("{} in quarantine, which `lightmill workers release {}` ends", some(in_quarantine),
                                  in_quarantine[0]));
  }
  if (!leaving.empty()) {
    reasons.push_back(fmt::format("{} leaving the farm", some(leaving)));
  }
  if (!reasons.empty()) {
    return fmt::format("waits for a worker: {}", fmt::join(reasons, "; "));
  }
  if (!too_small.empty()) {
    return fmt::format("waits for a larger worker; {}", too_small[0]);
  }
  if (of_others.empty()) {
    return "waits for a worker: none is connected";
  }
  const std::string fixed = job.record.spec.allow_mixed ? "" : job.record.fingerprint_class;
  return fmt::format("waits for a worker with renderer {}{}{}: {}", job.record.spec.settings.renderer_version,
                     fixed.empty() ? "" : " and fingerprint class ", fixed, of_others[0]);
}

JobStatus Coordinator::State::describe(const Job& job, Time now) const {
  const JobRecord& record = job.record;
  const JobSpec& spec = record.spec;
  JobStatus status;
  status.id = record.id;
  status.name = spec.name;
  status.owner = spec.owner;
  status.host = spec.host;
  status.method = spec.settings.method;
  status.method_notes = record.method_notes;
  status.fingerprint_class = record.fingerprint_class;
  status.parent = spec.parent;
  status.state = record.state;
  status.reason = record.reason.empty() ? reason_to_wait(job, now) : record.reason;
  status.reached = record.reached;
  status.priority = spec.priority;
  status.goal = spec.goal;
  status.width = spec.settings.width;
  status.height = spec.settings.height;
  status.crop = spec.settings.crop;
  for (const LayerSpec& layer : spec.settings.layers) {
    if (layer.name != kBeautyLayer) {
      status.layers.push_back(layer.name);
    }
  }
  status.seed = spec.settings.seed;
  status.samples_done = job.film.pixel_samples();
  status.samples_wanted = job.film.pixel_samples_at(spec.goal.samples);
  status.min_tile_samples = job.film.min_samples();
  status.max_tile_samples = job.film.max_samples();
  status.frame_samples = job.film.frame_samples();
  status.active_seconds = job.active_seconds(now);
  status.worker_seconds = record.worker_seconds;
  const FrameError error = job.error.update(job.film);
  if (record.state == JobState::running) {
    status.samples_per_second = job.rate.per_second(now);
    const double eta = expected_seconds(job, error, status.samples_per_second, now);
    status.eta_seconds = std::isinf(eta) ? -1 : eta;
  }
  status.error = {error.rel_mse, error.half_width, error.known && has_error(spec)};
  status.history = record.history;
  status.counters = record.counters;
  status.verify_share = spec.verify_share;
  status.allow_mixed = spec.allow_mixed;
  status.results_unverified = job.verifications.size();
  status.submitted_unix_ms = record.submitted_unix_ms;
  status.finished_unix_ms = record.finished_unix_ms;
  status.render_digest = job.digest;
  status.trace = trace_id(record.spec.request_id);
  return status;
}

Result<JobStatus> Coordinator::status(JobId id, Time now) const {
  const Job* const job = state_->find_job(id);
  if (job == nullptr) {
    return not_found("there is no job {}", id.value);
  }
  return state_->describe(*job, now);
}

std::set<Sha256> Coordinator::assets() const {
  std::set<Sha256> assets;
  for (const auto& [id, job] : state_->jobs) {
    const std::vector<Sha256>& named = job->record.spec.settings.assets;
    assets.insert(named.begin(), named.end());
  }
  return assets;
}

std::vector<JobStatus> Coordinator::jobs(Time now, const JobFilter& filter) const {
  std::vector<JobStatus> found;
  for (auto at = state_->jobs.lower_bound(filter.before); at != state_->jobs.begin() && found.size() < filter.most;) {
    const Job& job = *(--at)->second;
    if ((!filter.unfinished || job.active()) && (!filter.admits || filter.admits(job.record.spec.owner))) {
      found.push_back(state_->describe(job, now));
    }
  }
  return found;
}

WorkerCount count_of(const Worker& worker) {
  return {worker.hello.name, worker.hello.threads, static_cast<std::uint32_t>(worker.leases.size()),
          worker.results,    worker.leases_lost,   worker.pixel_samples};
}

FarmCounts Coordinator::counts() const {
  FarmCounts counts;
  counts.pixel_samples = state_->totals.pixel_samples;
  for (const auto& [id, job] : state_->jobs) {
    if (record_is_waiting(job->record.state)) {
      ++(job->leases.empty() ? counts.jobs_waiting : counts.jobs_running);
    }
  }
  for (const auto& [name, worker] : state_->workers) {
    if (worker.session) {
      counts.workers.push_back(count_of(worker));
    }
  }
  return counts;
}

void Coordinator::asset_is_missing(const Sha256& digest, Time now, Step& step) {
  State& state = *state_;
  std::erase_if(state.missing_assets, [&](const auto& entry) { return now - entry.second > kMissingPatience; });
  if (const auto known = state.missing_assets.find(digest); known != state.missing_assets.end()) {
    known->second = now;
    return;
  }
  for (auto& [id, job] : state.jobs) {
    if (record_is_waiting(job->record.state) && std::ranges::count(job->record.spec.settings.assets, digest) > 0) {
      state.missing_assets[digest] = now;
      ++job->version;
      note(step, Note::Level::warning, about(id), "job {} {}", id.value, state.reason_to_wait(*job, now));
    }
  }
}

const FarmTotals& Coordinator::totals() const {
  return state_->totals;
}

FarmCensus Coordinator::census() const {
  FarmCensus census;
  census.results_rate = state_->pace.bytes_per_second();
  census.units_out = state_->leases.size();
  for (const auto& [id, job] : state_->jobs) {
    ++census.jobs[static_cast<std::size_t>(job->record.state)];
    const Goal& goal = job->record.spec.goal;
    const bool counted = goal.samples > 0 || goal.error > 0;  // what time alone ends has no end of samples
    census.free_pixel_samples += counted && record_is_waiting(job->record.state) ? job->plan->free_pixel_samples() : 0;
  }
  for (const auto& [name, worker] : state_->workers) {
    if (worker.session) {
      census.threads += worker.hello.threads;
      ++(worker.quarantined      ? census.quarantined
         : worker.draining       ? census.draining
         : worker.leases.empty() ? census.idle
                                 : census.rendering);
    }
  }
  return census;
}

std::vector<WorkerStatus> Coordinator::workers(Time now, const WorkerFilter& filter) const {
  std::vector<WorkerStatus> all;
  // Of both kinds so many: those of the list are among them.
  for (auto at = state_->workers.upper_bound(filter.after); at != state_->workers.end() && all.size() < filter.most;
       ++at) {
    const auto& [name, worker] = *at;
    if (!worker.session) {
      continue;
    }
    WorkerStatus status;
    status.name = name;
    status.host = worker.hello.host;
    status.fingerprint_class = worker.hello.fingerprint_class;
    status.pid = worker.hello.pid;
    status.threads = worker.hello.threads;
    status.leases = static_cast<std::uint32_t>(worker.leases.size());
    status.draining = worker.draining;
    status.samples_per_second = worker.rate.per_second(now);
    status.connected_seconds = to_seconds(now - worker.connected_at);
    status.results = worker.results;
    status.leases_lost = worker.leases_lost;
    if (worker.quarantined) {
      status.quarantine = state_->reason_for_quarantine(renderer_of(worker.hello));
    }
    all.push_back(std::move(status));
  }
  const std::size_t connected = all.size();
  for (auto at = state_->quarantine.upper_bound(filter.after);
       at != state_->quarantine.end() && all.size() - connected < filter.most; ++at) {
    const auto& [name, record] = *at;
    const Worker* const worker = state_->find_worker(name);
    if (worker == nullptr || !worker->session) {
      WorkerStatus status;
      status.name = name;
      status.host = record.of.machine;
      status.threads = 0;
      status.connected = false;
      status.quarantine = record.reason;
      all.push_back(std::move(status));
    }
  }
  std::ranges::sort(all, {}, &WorkerStatus::name);
  all.resize(std::min(all.size(), filter.most));
  return all;
}

Result<const JobSpec*> Coordinator::spec(JobId id) const {
  const Job* const job = state_->find_job(id);
  if (job == nullptr) {
    return not_found("there is no job {}", id.value);
  }
  return &job->record.spec;
}

Result<std::string> Coordinator::owner(JobId id) const {
  const Job* const job = state_->find_job(id);
  if (job == nullptr) {
    return not_found("there is no job {}", id.value);
  }
  return job->record.spec.owner;
}

const Film* Coordinator::film(JobId id) const {
  const Job* const job = state_->find_job(id);
  return job == nullptr ? nullptr : &job->film;
}

std::uint64_t Coordinator::version(JobId id) const {
  const Job* const job = state_->find_job(id);
  return job == nullptr ? 0 : job->version;
}

std::vector<std::pair<JobId, std::uint64_t>> Coordinator::versions(std::size_t most) const {
  std::vector<std::pair<JobId, std::uint64_t>> found;
  for (auto at = state_->jobs.rbegin(); at != state_->jobs.rend() && found.size() < most; ++at) {
    found.emplace_back(at->first, at->second->version);
  }
  return found;
}

}  // namespace lightmill
