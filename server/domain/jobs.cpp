#include "server/domain/jobs.h"

#include "common/base/check.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

double gib(std::uint64_t bytes) {
  return static_cast<double>(bytes) / static_cast<double>(std::uint64_t{1} << 30);
}

}  // namespace

Job::Job(JobRecord from, const CoordinatorLimits& limits, Time now)
    : record(std::move(from)),
      film(grid_of(record.spec.settings), NodeLayout(record.spec.settings.layers), record.allocation),
      hold_until(now),
      losses(limits),
      digest_durable_(!record.fingerprint_class.empty() && !undecided()) {
  if (digest_durable_) {
    digest_ = render_digest(record.spec.settings, record.fingerprint_class);
  }
  if (active()) {
    plan = std::make_unique<JobPlan>(film, samples_wanted_now(), limits.film_bytes_per_job);
  }
}

// ---- class and method ----

void Job::bind(const std::string& fingerprint_class, LeaseId last) {
  record.fingerprint_class = record.spec.allow_mixed ? kMixedClass : fingerprint_class;
  bound_at_ = last;
  if (!undecided()) {
    digest_ = render_digest(record.spec.settings, record.fingerprint_class);
  }
}

void Job::unbind() {
  record.fingerprint_class.clear();
  digest_ = {};
  digest_durable_ = false;
}

void Job::choose_method(const PilotReport& report) {
  MethodNotes& notes = record.method_notes;
  record.spec.settings.method = notes.candidates[report.choice];
  for (const std::string& reason : report.reasons) {
    notes.reasons.push_back(printable(reason));
  }
  notes.candidates.clear();
  if (!report.allocation.even()) {
    record.allocation = report.allocation;
    film = Film(film.grid(), film.layout(), report.allocation);
    plan->set_goal(samples_wanted_now());
  }
  record.worker_seconds += report.seconds;
  digest_ = render_digest(record.spec.settings, record.fingerprint_class);
  digest_durable_ = false;  // leases wait until the method is stored
}

// ---- leases and time ----

void Job::lease_opened(LeaseId lease, Time now) {
  leases_.insert(lease);
  lease_sent(now);
}

void Job::lease_waits() {
  if (--leases_sent_ == 0) {
    active_since_.reset();
  }
}

void Job::lease_sent(Time now) {
  if (!active_since_ && !undecided()) {
    active_since_ = now;
  }
  ++leases_sent_;
}

void Job::lease_ended(const Lease& lease, Time now) {
  leases_.erase(lease.id);
  leases_sent_ -= lease.sent ? 1 : 0;
  if (leases_sent_ == 0) {
    record.active_seconds = active_seconds(now);
    active_since_.reset();
  }
}

void Job::keep_time(double kept, Time now) {
  if (record.spec.goal.seconds == 0) {
    return;
  }
  record.active_seconds = kept * active_seconds(now);
  if (active_since_) {
    active_since_ = now;
  }
  if (plan && plan->closed() && !time_is_up(now)) {
    plan->set_goal(samples_wanted_now());
  }
}

std::optional<Time> Job::time_up_at() const {
  if (!active_since_ || plan->closed()) {
    return std::nullopt;
  }
  return *active_since_ + from_seconds(std::max(record.spec.goal.seconds - record.active_seconds, 0.0)) +
         std::chrono::microseconds(1);
}

// ---- samples ----

std::uint64_t Job::sample_limit() const {
  return record.spec.goal.samples > 0 ? record.spec.goal.samples : most_samples(record.spec.goal);
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

bool Job::record_error(bool at_end) {
  const double samples = static_cast<double>(film.pixel_samples()) / static_cast<double>(film.grid().pixel_count());
  const double last = record.history.empty() ? 0 : record.history.back().samples;
  constexpr double kRounding = 1e-6;  // the frame's counts are whole
  const std::uint64_t next = next_error_count(static_cast<std::uint64_t>(last / film.mean_share() + kRounding) + 1);
  if (samples <= last || (!at_end && film.frame_samples() < next)) {
    return false;
  }
  const FrameError frame = error.update(film);
  const bool known = frame.known && has_error(record.spec);
  if (known) {
    record.history.push_back({samples, record.worker_seconds, frame.rel_mse, frame.half_width});
  }
  return known;
}

// ---- rows ----

void Job::store(const Event& event) {
  ++version;
  event.store(PutJob{record});
}

void Job::store_progress(const Event& event) {
  ++version;
  event.store(PutProgress{id(), active_seconds(event.now), record.worker_seconds, record.counters});
}

// ---- the table ----

Job* JobTable::find(JobId id) const {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second.get();
}

Result<Job*> JobTable::get(JobId id) const {
  if (Job* const job = find(id)) {
    return job;
  }
  return not_found("there is no job {}", id.value);
}

std::optional<JobId> JobTable::of_request(const std::string& request_id) const {
  const auto found = by_request_.find(request_id);
  return found == by_request_.end() ? std::nullopt : std::optional(found->second);
}

Job& JobTable::add(const JobSpec& spec, const MethodNotes& notes, const Event& event) {
  JobRecord record;
  record.id = JobId{next_id_++};
  record.spec = spec;
  record.method_notes = notes;
  record.submitted_unix_ms = event.unix_ms;
  by_request_[spec.request_id] = record.id;
  const JobId id = record.id;
  return *jobs_.emplace(id, std::make_unique<Job>(std::move(record), limits_, event.now)).first->second;
}

Job& JobTable::restore(StoredState::StoredJob stored, Time now) {
  const JobId id = stored.record.id;
  by_request_[stored.record.spec.request_id] = id;
  Job& job = *jobs_.emplace(id, std::make_unique<Job>(std::move(stored.record), limits_, now)).first->second;
  for (StoredState::StoredNode& node : stored.nodes) {
    LM_CHECK(node.tile.value < job.film.grid().tile_count(), "job {} has a stored node of tile {} of {}", id.value,
             node.tile.value, job.film.grid().tile_count());
    job.film.restore(node.tile, std::move(node.node));
  }
  job.restored = true;
  job.pictured = job.film.min_samples() > 0 || job.record.counters.results_merged > 0;
  return job;
}

void JobTable::remove(JobId id, const Event& event) {
  by_request_.erase(at(id).record.spec.request_id);
  jobs_.erase(id);
  event.store(DeleteJobRows{id});
}

Status JobTable::check_room(const std::string& owner) const {
  if (jobs_.size() >= limits_.max_jobs) {
    return resource_exhausted("the farm keeps at most {} jobs: delete some that have ended", limits_.max_jobs);
  }
  const auto own =
      std::ranges::count_if(jobs_, [&](const auto& entry) { return entry.second->record.spec.owner == owner; });
  if (own >= std::int64_t{limits_.max_jobs_per_owner}) {
    return resource_exhausted("the farm keeps at most {} jobs of one user, '{}': delete some that have ended",
                              limits_.max_jobs_per_owner, owner);
  }
  return ok_status();
}

Status JobTable::check_footprint(const JobSpec& spec, const Job* instead_of) const {
  const std::uint64_t own = finished_bytes(spec);
  if (own > limits_.film_bytes) {
    return invalid_argument("the film may come to hold {:.4g} GiB, more than --films-gib {:.4g} of the server allows",
                            gib(own), gib(limits_.film_bytes));
  }
  std::uint64_t all = own;
  for (const auto& [id, job] : jobs_) {
    if (job.get() != instead_of) {
      all += job->active() ? std::max(job->film.bytes(), finished_bytes(job->record.spec)) : job->film.bytes();
    }
  }
  if (all > limits_.film_bytes) {
    return resource_exhausted(
        "the films of all jobs may come to hold {:.4g} GiB, more than --films-gib {:.4g} of the server allows: delete "
        "jobs that have ended",
        gib(all), gib(limits_.film_bytes));
  }
  return ok_status();
}

}  // namespace lightmill
