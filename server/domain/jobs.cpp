#include "server/domain/jobs.h"

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/farm/job_rules.h"

namespace lightmill {
namespace {

double gib(std::uint64_t bytes) {
  return static_cast<double>(bytes) / static_cast<double>(std::uint64_t{1} << 30);
}

bool is_in(const FilmOutline& film, const StoredState::StoredNode& stored) {
  const NodeOutline* const known =
      stored.tile.value < film.grid().tile_count() ? film.find(stored.tile, stored.outline.range) : nullptr;
  return known != nullptr && *known == stored.outline;
}

}  // namespace

Job::Job(JobRecord from, const CoordinatorLimits& limits, Time now)
    : record(std::move(from)),
      hold_until(now),
      losses(limits),
      film_(std::in_place_type<Film>, grid_of(record.spec.settings), NodeLayout(record.spec.settings.layers),
            record.allocation),
      digest_durable_(!record.fingerprint_class.empty() && !undecided()),
      shown_state_(record.state) {
  if (digest_durable_) {
    digest_ = render_digest(record.spec.settings, record.fingerprint_class);
  }
  if (active()) {
    plan = std::make_unique<JobPlan>(film(), samples_wanted_now(), limits.film_bytes_per_job);
  }
}

// ---- film ----

const FilmOutline& Job::outline() const {
  return std::visit([](const FilmOutline& film) -> const FilmOutline& { return film; }, film_);
}

const Film& Job::film() const {
  LM_CHECK(has_film(), "the film of job {} is in the store alone", id().value);
  return std::get<Film>(film_);
}

Film& Job::film() {
  return const_cast<Film&>(std::as_const(*this).film());
}

void Job::drop_node(TileId tile, SampleRange range) {
  unkept = true;
  std::visit([&](auto& film) { film.drop(tile, range); }, film_);
}

void Job::restore_film(StoredFilm nodes) {
  if (std::ranges::any_of(nodes, [](const StoredState::StoredNode& node) { return node.node == nullptr; })) {
    drop_film();
  }
  for (StoredState::StoredNode& node : nodes) {
    LM_CHECK(node.tile.value < outline().grid().tile_count(), "job {} has a stored node of tile {} of {}", id().value,
             node.tile.value, outline().grid().tile_count());
    if (has_film()) {
      film().restore(node.tile, std::move(node.node));
    } else {
      std::get<FilmOutline>(film_).restore(node.tile, node.outline);
    }
  }
}

void Job::drop_film() {
  LM_CHECK(!active());
  film_ = FilmOutline(std::move(film()));
}

std::vector<NodeKey> Job::missing_from(const StoredFilm& nodes) const {
  std::set<std::pair<TileId, SampleRange>> there;
  for (const StoredState::StoredNode& node : nodes) {
    if (is_in(outline(), node)) {
      there.emplace(node.tile, node.outline.range);
    }
  }
  std::vector<NodeKey> missing;
  for (TileId tile{0}; tile.value < outline().grid().tile_count(); ++tile.value) {
    for (const NodeOutline& node : outline().nodes(tile)) {
      if (!there.contains({tile, node.range})) {
        missing.push_back({id(), tile, node.range});
      }
    }
  }
  return missing;
}

void Job::take_film(StoredFilm nodes) {
  std::ranges::sort(nodes, {}, [](const auto& node) { return node.outline.range.first(); });
  std::vector<std::vector<NodePtr>> forests(outline().grid().tile_count());
  for (StoredState::StoredNode& node : nodes) {
    if (is_in(outline(), node)) {
      forests[node.tile.value].push_back(std::move(node.node));
    }
  }
  film_ = Film(std::move(std::get<FilmOutline>(film_)), std::move(forests));
}

FrameError Job::frame_error() const {
  if (has_film()) {
    return error.update(film());
  }
  if (record.history.empty() || record.history.back().samples != mean_samples()) {
    return {};
  }
  return {record.history.back().rel_mse, record.history.back().half_width, true};
}

double Job::mean_samples() const {
  return static_cast<double>(outline().pixel_samples()) / static_cast<double>(outline().grid().pixel_count());
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
    film() = Film(outline().grid(), outline().layout(), report.allocation);
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
  for (std::uint32_t tile = 0; tile < outline().grid().tile_count(); ++tile) {
    const std::vector<NodeOutline>& nodes = outline().nodes(TileId{tile});
    end = std::max(end, outline().allocation().frame_for(TileId{tile}, nodes.empty() ? 0 : nodes.back().range.end()));
  }
  return end;
}

bool Job::has_gaps() const {
  for (std::uint32_t tile = 0; tile < outline().grid().tile_count(); ++tile) {
    const std::vector<NodeOutline>& nodes = outline().nodes(TileId{tile});
    if (!nodes.empty() && nodes.back().range.end() != outline().samples(TileId{tile})) {
      return true;
    }
  }
  return false;
}

bool Job::error_met() const {
  const double goal = record.spec.goal.error;
  const std::uint64_t count = outline().frame_samples();
  return goal > 0 && next_error_count(count) == count && outline().has_just(count) && !has_gaps() &&
         meets(has_film() ? error.update_all(film()) : frame_error(), goal);
}

std::uint64_t Job::samples_wanted_now() const {
  if (record.spec.goal.error == 0) {
    return sample_limit();
  }
  std::uint64_t count = next_error_count(samples_end());
  if (outline().frame_samples() == count && !error_met()) {
    count = next_error_count(count + 1);
  }
  return std::min(count, sample_limit());
}

bool Job::record_error(bool at_end) {
  const double samples = mean_samples();
  const double last = record.history.empty() ? 0 : record.history.back().samples;
  constexpr double kRounding = 1e-6;  // counts of the frame are integers
  const std::uint64_t next =
      next_error_count(static_cast<std::uint64_t>(last / outline().mean_share() + kRounding) + 1);
  const bool again = at_end && samples == last;
  if (!again && (samples <= last || (!at_end && outline().frame_samples() < next))) {
    return false;
  }
  const FrameError frame = error.update(film());
  const bool known = frame.known && has_error(record.spec);
  if (known && again) {
    record.history.back().rel_mse = frame.rel_mse;
    record.history.back().half_width = frame.half_width;
  } else if (known) {
    record.history.push_back({samples, record.worker_seconds, frame.rel_mse, frame.half_width});
  }
  return known;
}

std::uint64_t Job::reserved_bytes() const {
  return std::max(outline().bytes(), finished_bytes(record.spec));
}

// ---- end ----

void Job::end(JobState state) {
  shown_state_ = record.state;
  record.state = state;
}

void Job::end_stored() {
  if (--ends_unstored_ == 0 && has_ended(record.state)) {
    shown_state_ = record.state;
    ++version;
  }
}

// ---- rows ----

void Job::store(const Event& event) {
  ++version;
  ends_unstored_ += has_ended(record.state) ? 1 : 0;
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
  job.restore_film(std::move(stored.nodes));
  job.restored = true;
  job.pictured = job.outline().min_samples() > 0 || job.record.counters.results_merged > 0;
  return job;
}

void JobTable::remove(JobId id, const Event& event) {
  const JobSpec& spec = at(id).record.spec;
  by_request_.erase(spec.request_id);
  event.store(DeleteJobRows{id, spec.name});
  jobs_.erase(id);
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
    return invalid_argument("the film may need {:.4g} GiB, more than --films-gib {:.4g} of the server allows", gib(own),
                            gib(limits_.film_bytes));
  }
  std::uint64_t active = own, largest_ended = 0;
  for (const auto& [id, job] : jobs_) {
    if (job.get() != instead_of && job->active()) {
      active += job->reserved_bytes();
    } else if (job.get() != instead_of) {
      largest_ended = std::max(largest_ended, job->outline().bytes());
    }
  }
  if (active + largest_ended > limits_.film_bytes) {
    return resource_exhausted(
        "the films of all jobs that have not ended may need {:.4g} GiB, and the largest film of an ended job {:.4g} "
        "GiB: more than --films-gib {:.4g} of the server allows; try again when a job has ended",
        gib(active), gib(largest_ended), gib(limits_.film_bytes));
  }
  return ok_status();
}

}  // namespace lightmill
