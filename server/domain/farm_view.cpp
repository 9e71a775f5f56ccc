#include "server/domain/farm_view.h"

#include <cmath>

#include "common/farm/job_rules.h"

namespace lightmill {

JobStatus FarmView::status(const Job& job, Time now) const {
  WorkerKinds kinds(workers_);
  return status(job, now, kinds);
}

JobStatus FarmView::decided_status(const Job& job, Time now) const {
  WorkerKinds kinds(workers_);
  return decided_status(job, now, kinds);
}

JobStatus FarmView::status(const Job& job, Time now, WorkerKinds& kinds) const {
  JobStatus status = decided_status(job, now, kinds);
  if (job.shown_state() != status.state) {
    status.state = job.shown_state();
    status.reason = scheduler_.held();
    status.reached = GoalLimit::none;
    status.finished_unix_ms = 0;
  }
  return status;
}

JobStatus FarmView::decided_status(const Job& job, Time now, WorkerKinds& kinds) const {
  const JobRecord& record = job.record();
  JobStatus status;
  status.id = record.id;
  status.spec = record.spec;
  status.spec.settings.scene = {};  // a status may outlive the job
  status.spec.settings.assets = {};
  status.fingerprint_class = record.fingerprint_class;
  status.method_notes = record.method_notes;
  status.state = record.state;
  status.reason = record.reason.empty() ? waits_.of(job, now, kinds).text : record.reason;
  status.reached = record.reached;
  status.samples_done = job.outline().pixel_samples();
  status.samples_wanted = job.outline().pixel_samples_at(record.spec.goal.samples);
  status.min_tile_samples = job.outline().min_samples();
  status.max_tile_samples = job.outline().max_samples();
  status.frame_samples = job.outline().frame_samples();
  status.active_seconds = job.active_seconds(now);
  status.worker_seconds = record.worker_seconds;
  const FrameError error = job.frame_error();
  if (record.state == JobState::running) {
    status.samples_per_second = job.samples_per_second(now);
    const double eta = expected_seconds(job, error, now);
    status.eta_seconds = std::isinf(eta) ? -1 : eta;
  }
  status.error = {error.rel_mse, error.half_width, error.known && method_has_error(record.spec.settings.method)};
  status.history = record.history;
  status.counters = record.counters;
  status.results_unaudited = job.audits().unaudited();
  status.audits_lost = job.audits().lost();
  status.one_identity = job.audits().waiting() && audits_.one_identity(job);
  status.submitted_unix_ms = record.submitted_unix_ms;
  status.finished_unix_ms = record.finished_unix_ms;
  status.render_digest = job.digest();
  return status;
}

namespace {

bool fits(const Job& job, const JobFilter& filter) {
  const JobState state = job.shown_state();
  return (!filter.unfinished || !has_ended(state)) && (filter.states.empty() || filter.states.contains(state)) &&
         (!filter.admits || filter.admits(job.record()));
}

}  // namespace

std::vector<JobStatus> FarmView::jobs(Time now, const JobFilter& filter) const {
  std::vector<JobStatus> found;
  WorkerKinds kinds(workers_);
  const auto& all = jobs_.all();
  for (auto at = all.lower_bound(filter.before); at != all.begin() && found.size() < filter.most;) {
    const Job& job = *(--at)->second;
    if (fits(job, filter)) {
      found.push_back(status(job, now, kinds));
    }
  }
  return found;
}

std::size_t FarmView::count_jobs(const JobFilter& filter) const {
  const auto& all = jobs_.all();
  return static_cast<std::size_t>(std::count_if(all.begin(), all.lower_bound(filter.before),
                                                [&](const auto& entry) { return fits(*entry.second, filter); }));
}

WorkerStatus FarmView::status(const Worker& worker, Time now) const {
  WorkerStatus status;
  status.name = worker.name();
  status.host = worker.hello().host;
  status.fingerprint_class = worker.hello().fingerprint_class;
  status.pid = worker.hello().pid;
  status.threads = worker.hello().threads;
  status.leases = static_cast<std::uint32_t>(worker.leases().size());
  status.draining = worker.draining();
  status.samples_per_second = worker.samples_per_second(now);
  status.connected_seconds = to_seconds(now - worker.connected_at());
  status.results = worker.results();
  status.leases_lost = worker.leases_lost();
  if (worker.quarantined()) {
    status.quarantine = quarantine_.reason_for(worker.renderer(), worker.host_as_identity());
  }
  return status;
}

std::vector<WorkerStatus> FarmView::workers(Time now, const WorkerFilter& filter) const {
  std::vector<WorkerStatus> found;
  // `most` of both kinds contain the first `most` of the merged list.
  const auto& all = workers_.all();
  for (auto at = all.upper_bound(filter.after); at != all.end() && found.size() < filter.most; ++at) {
    if (at->second.session()) {
      found.push_back(status(at->second, now));
    }
  }
  const std::size_t connected = found.size();
  const auto& held = quarantine_.all();
  for (auto at = held.upper_bound(filter.after); at != held.end() && found.size() - connected < filter.most; ++at) {
    const auto& [name, record] = *at;
    const Worker* const worker = workers_.find(name);
    if (worker == nullptr || !worker->session()) {
      WorkerStatus& status = found.emplace_back();
      status.name = name;
      status.host = record.host.empty() ? record.of.identity : record.host;
      status.threads = 0;
      status.connected = false;
      status.quarantine = record.reason;
    }
  }
  std::ranges::sort(found, {}, &WorkerStatus::name);
  found.resize(std::min(found.size(), filter.most));
  return found;
}

namespace {

/// Pairs of job and worker. A job that waits may have to be compared with all workers.
constexpr std::size_t kMaxExplained = 1'000'000;

}  // namespace

FarmLoad FarmView::load() const {
  FarmLoad load;
  load.pixel_samples = totals_.pixel_samples;
  for (const auto& [id, job] : jobs_.all()) {
    if (job->in_progress()) {
      ++(job->leases().empty() ? load.jobs_waiting : load.jobs_running);
    }
  }
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.session()) {
      load.workers.push_back(worker.count());
    }
  }
  return load;
}

FarmGauges FarmView::gauges(Time now) const {
  FarmGauges farm;
  WorkerKinds kinds(workers_);
  std::size_t explained = 0;
  farm.results_rate = scheduler_.result_bytes_per_second();
  farm.leases = leases_.all().size();
  for (const auto& [id, job] : jobs_.all()) {
    ++farm.jobs[static_cast<std::size_t>(job->shown_state())];
    if (const Wait wait = explained <= kMaxExplained ? waits_.of(*job, now, kinds) : Wait{}; !wait.text.empty()) {
      ++farm.waits[static_cast<std::size_t>(wait.reason)];
      explained += workers_.all().size();
    }
    const Goal& goal = job->spec().goal;
    const bool counted = goal.samples > 0 || goal.error > 0;  // a job that ends only by time has no limit of samples
    farm.free_pixel_samples += counted && job->in_progress() ? job->plan().free_pixel_samples() : 0;
  }
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.session()) {
      farm.threads += worker.hello().threads;
      ++(worker.quarantined()      ? farm.quarantined
         : worker.draining()       ? farm.draining
         : worker.leases().empty() ? farm.idle
                                   : farm.rendering);
    }
  }
  return farm;
}

// ---- demand ----

namespace {

/// Least work for which a worker is wanted, because it must first start and fetch scene and assets.
constexpr double kWorthwhileSeconds = 60;

/// Threads that the job keeps busy for kWorthwhileSeconds. Nothing if it uses the connected workers: its sample cost is
/// unknown, or it ends before a new worker would help.
std::optional<double> threads_for(const Job& job, Time now) {
  if (job.plan().closed() && !job.plan().has_work()) {
    return 0;  // it only waits for open leases
  }
  const double cost = job.cost().mean.value();
  const Goal& goal = job.spec().goal;
  if (job.undecided() || cost <= 0 ||
      (goal.seconds > 0 && goal.seconds - job.active_seconds(now) < kWorthwhileSeconds)) {
    return std::nullopt;
  }
  double left = expected_pixel_samples(job, goal.error > 0 ? job.frame_error() : FrameError{});
  if (std::isinf(left) && goal.error == 0) {  // only time ends it: it can use any number of threads
    return job.film().grid().tile_count();
  }
  if (std::isinf(left)) {  // its error cannot be read yet
    left = static_cast<double>(job.film().pixel_samples_at(job.samples_wanted_now()) - job.film().pixel_samples());
  }
  return left * cost / kWorthwhileSeconds;
}

}  // namespace

bool FarmView::wants_workers() const {
  const bool waiting = std::ranges::any_of(jobs_.all(), [](const auto& entry) { return entry.second->in_progress(); });
  return (scheduler_.held().empty() && waiting) || std::ranges::any_of(workers_.all(), [](const auto& entry) {
           return entry.second.counts() && !entry.second.leases().empty();
         });
}

std::uint32_t FarmView::wanted_workers(Time now) const {
  std::uint32_t there = 0, busy = 0, quarantined = 0;
  WorkerKinds kinds(workers_);
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.counts()) {
      ++there;
      busy += worker.leases().empty() ? 0 : 1;
    }
    quarantined += worker.session() && worker.quarantined() ? 1 : 0;
  }
  const auto threads_there = static_cast<double>(workers_.claimed_threads());
  bool waiting = false, all_that_are_here = false;
  double threads = 0;
  for (const auto& [id, job] : jobs_.all()) {
    if (!scheduler_.held().empty() || !job->in_progress()) {
      continue;
    }
    waiting = true;
    // If no connected worker can render it, more workers of their version and class would not help. A new one may be of
    // another class.
    if (!job->leases().empty() || kinds.any_may_render(*job)) {
      const std::optional<double> keeps_busy = threads_for(*job, now);
      threads += keeps_busy.value_or(0);
      all_that_are_here = all_that_are_here || !keeps_busy;
    }
  }
  if (all_that_are_here) {
    threads = std::max(threads, threads_there);
  }
  double wanted = waiting ? 1 : 0;
  if (there > 0) {
    wanted = std::max(wanted, std::ceil(threads * there / threads_there));
  }
  // No busy worker is sent away, so the last work is spread over all connected workers.
  wanted = std::max<double>(wanted, busy);
  // The autoscaler counts a quarantined worker, which renders nothing.
  wanted += wanted > 0 ? quarantined : 0;
  return static_cast<std::uint32_t>(std::min<double>(wanted, std::max(limits_.max_workers, busy)));
}

}  // namespace lightmill
