#include "server/domain/job.h"

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/farm/job_rules.h"

namespace lightmill {
namespace {

bool is_in(const FilmOutline& film, const StoredState::StoredNode& stored) {
  const NodeOutline* const known =
      stored.tile.value < film.grid().tile_count() ? film.find(stored.tile, stored.outline.range) : nullptr;
  return known != nullptr && *known == stored.outline;
}

}  // namespace

Job::Job(JobRecord from, const CoordinatorLimits& limits, Time now)
    : limits_(limits),
      record_(std::move(from)),
      held_until_(now),
      film_(std::in_place_type<Film>, grid_of(spec().settings), NodeLayout(spec().settings.layers), record_.allocation),
      losses_(limits),
      digest_durable_(!record_.fingerprint_class.empty() && !undecided()),
      digest_(digest_durable_ ? render_digest(spec().settings, record_.fingerprint_class) : Sha256()),
      shown_state_(state()) {
  if (active()) {
    make_plan(now);
  }
}

void Job::restore(StoredFilm nodes, Time now) {
  if (std::ranges::any_of(nodes, [](const StoredState::StoredNode& node) { return node.node == nullptr; })) {
    drop_film();
  }
  for (StoredState::StoredNode& node : nodes) {
    LM_CHECK(node.tile.value < outline().grid().tile_count(), "job {} has a stored node of tile {} of {}", id().value,
             node.tile.value, outline().grid().tile_count());
    if (Film* const film = std::get_if<Film>(&film_)) {
      film->restore(node.tile, std::move(node.node));
    } else {
      std::get<FilmOutline>(film_).restore(node.tile, node.outline);
    }
  }
  restored_ = true;
  pictured_ = outline().min_samples() > 0 || record_.counters.results_merged > 0;
  if (active()) {
    make_plan(now);
  }
}

// ---- state ----

void Job::make_plan(Time now) {
  plan_ = std::make_unique<JobPlan>(film(), samples_wanted_now(), limits_.film_bytes_per_job);
  if (time_is_up(now)) {
    plan_->close();
  }
}

void Job::start(const std::string& fingerprint_class, LeaseId last) {
  record_.state = JobState::running;
  record_.fingerprint_class = spec().allow_mixed ? kMixedClass : fingerprint_class;
  bound_at_ = last;
  if (!undecided()) {
    digest_ = render_digest(spec().settings, record_.fingerprint_class);
  }
}

void Job::unbind() {
  record_.state = in_progress() ? JobState::queued : state();
  record_.fingerprint_class.clear();
  digest_ = {};
  digest_durable_ = false;
}

void Job::pause(std::string reason) {
  record_.state = JobState::paused;
  record_.reason = std::move(reason);
}

void Job::resume() {
  record_.state = record_.fingerprint_class.empty() ? JobState::queued : JobState::running;
  record_.reason.clear();
}

void Job::extend(const Goal& goal) {
  record_.spec.goal = goal;
  if (active()) {
    plan_->set_goal(samples_wanted_now());
  }
}

void Job::end(JobState state, GoalLimit reached, std::string reason, const Event& event) {
  record_error(true);
  shown_state_ = record_.state;
  record_.state = state;
  record_.reached = reached;
  record_.reason = std::move(reason);
  record_.finished_unix_ms = event.unix_ms;
  plan_.reset();
  losses_ = Losses(limits_);
  refusals_ = {};
  if (state != JobState::done) {
    audits_ = {};  // a done job may still finish its audits when it is extended
  }
}

void Job::reopen(Time now) {
  awaits_film_ = false;
  record_.state = JobState::running;
  record_.reason.clear();
  record_.reached = GoalLimit::none;
  record_.finished_unix_ms = 0;
  make_plan(now);
}

// ---- parts with rules of their own ----

JobPlan& Job::plan() const {
  LM_CHECK(plan_ != nullptr, "job {} is not active", id().value);
  return *plan_;
}

Losses::Blame Job::suspect(const Lease& lost, const std::string& identity) {
  Losses::Blame blame = losses_.add(lost, identity, outline().grid());
  for (std::size_t i = 0; i < lost.unit.tiles.size(); ++i) {
    if (!lost.done[i] && losses_.is_suspect(lost.unit.tiles[i])) {
      plan().set_alone(lost.unit.tiles[i], true);
    }
  }
  return blame;
}

// ---- film ----

const FilmOutline& Job::outline() const {
  return std::visit([](const FilmOutline& film) -> const FilmOutline& { return film; }, film_);
}

const Film& Job::film() const {
  LM_CHECK(has_film(), "the film of job {} is in the store alone", id().value);
  return std::get<Film>(film_);
}

Job::Merged Job::merge(TileId tile, NodePtr node, const std::string& identity, double seconds, Time now) {
  const std::uint64_t non_finite_before = film().non_finite(), samples_before = film().pixel_samples();
  Merged merged{.outcome = std::get<Film>(film_).merge(tile, std::move(node))};
  if (merged.outcome.kind != MergeOutcome::Kind::merged) {
    ++record_.counters.results_duplicate;
    return merged;
  }
  ++record_.counters.results_merged;
  refusals_.rendered_by(identity);
  plan().rendered(tile, identity);
  if (losses_.tile_received(tile)) {
    plan().set_alone(tile, false);
  }
  if (spec().goal.error > 0 && film().samples(tile) == plan().goal_of(tile)) {
    error_.refresh(film(), tile);  // leaves little to do when the last tile comes
  }
  record_.counters.non_finite += film().non_finite() - non_finite_before;
  merged.pixel_samples = film().pixel_samples() - samples_before;
  rate_.add(static_cast<double>(merged.pixel_samples), now);
  steady_rate_.add(static_cast<double>(merged.pixel_samples), seconds, active_seconds(now));
  merged.first_picture = !pictured_ && film().min_samples() > 0;
  pictured_ = pictured_ || merged.first_picture;
  return merged;
}

std::optional<SampleRange> Job::drop_node(TileId tile, SampleRange within, Time now) {
  const NodeOutline* const node = outline().find(tile, within);
  if (node == nullptr) {
    return std::nullopt;
  }
  const SampleRange range = node->range;
  record_.counters.non_finite -= node->non_finite;
  ++record_.counters.nodes_dropped;
  const auto before = static_cast<double>(outline().pixel_samples());
  std::visit([&](auto& film) { film.drop(tile, range); }, film_);
  unkept_ = true;
  keep_time(static_cast<double>(outline().pixel_samples()) / before, now);
  if (plan_) {
    plan_->reopen(tile);
  }
  ++version_;
  return range;
}

void Job::drop_film() {
  LM_CHECK(!active() && has_film());
  film_ = FilmOutline(std::move(std::get<Film>(film_)));
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
    return error_.update(film());
  }
  if (record_.history.empty() || record_.history.back().samples != mean_samples()) {
    return {};
  }
  return {record_.history.back().rel_mse, record_.history.back().half_width, true};
}

// ---- class and method ----

void Job::choose_method(const PilotReport& report, double seconds, const std::string& identity) {
  losses_.pilot_received();
  refusals_.rendered_by(identity);
  MethodNotes& notes = record_.method_notes;
  record_.spec.settings.method = notes.candidates[report.choice];
  for (const std::string& reason : report.reasons) {
    notes.reasons.push_back(printable(reason));
  }
  notes.candidates.clear();
  if (!report.allocation.even()) {
    record_.allocation = report.allocation;
    film_ = Film(outline().grid(), outline().layout(), report.allocation);
    plan().set_goal(samples_wanted_now());
  }
  record_.worker_seconds += seconds;
  digest_ = render_digest(spec().settings, record_.fingerprint_class);
  digest_durable_ = false;  // leases wait until the method is stored
}

// ---- leases and time ----

void Job::lease_opened(const Lease& lease, Time now) {
  leases_.insert(lease.id);
  record_.counters.copies_leased += lease.copy ? lease.unit.tiles.size() : 0;
  lease_sent(now);
}

void Job::lease_sent(Time now) {
  if (!active_since_ && !undecided()) {
    active_since_ = now;
  }
  ++leases_sent_;
}

void Job::lease_ended(const Lease& lease, bool lost, Time now) {
  leases_.erase(lease.id);
  leases_sent_ -= lease.sent ? 1 : 0;
  if (leases_sent_ == 0) {
    record_.active_seconds = active_seconds(now);
    active_since_.reset();
  }
  if (lost) {
    ++record_.counters.leases_lost;
    ++version_;
  }
}

void Job::keep_time(double kept, Time now) {
  if (spec().goal.seconds == 0) {
    return;
  }
  record_.active_seconds = kept * active_seconds(now);
  if (active_since_) {
    active_since_ = now;
  }
  steady_rate_ = {};  // active time went back
  if (plan_ && plan_->closed() && !time_is_up(now)) {
    plan_->set_goal(samples_wanted_now());
  }
}

std::optional<Time> Job::time_up_at() const {
  if (!active_since_ || plan().closed()) {
    return std::nullopt;
  }
  return *active_since_ + from_seconds(std::max(spec().goal.seconds - record_.active_seconds, 0.0)) +
         std::chrono::microseconds(1);
}

// ---- workers ----

void Job::add_cost(double seconds, std::uint64_t pixel_samples) {
  record_.worker_seconds += seconds;
  if (seconds > 0) {
    cost_.add(seconds / static_cast<double>(pixel_samples));
  }
}

// ---- samples ----

std::uint64_t Job::sample_limit() const {
  return spec().goal.samples > 0 ? spec().goal.samples : most_samples(spec().goal);
}

std::uint64_t Job::samples_end() const {
  std::uint64_t end = plan_ ? plan_->out_end() : 0;
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
  const double goal = spec().goal.error;
  const std::uint64_t count = outline().frame_samples();
  return goal > 0 && next_error_count(count) == count && outline().has_exactly(count) && !has_gaps() &&
         meets(has_film() ? error_.update_all(film()) : frame_error(), goal);
}

std::uint64_t Job::samples_wanted_now() const {
  if (spec().goal.error == 0) {
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
  const double last = record_.history.empty() ? 0 : record_.history.back().samples;
  constexpr double kRounding = 1e-6;  // counts of the frame are integers
  const std::uint64_t next =
      next_error_count(static_cast<std::uint64_t>(last / outline().mean_share() + kRounding) + 1);
  const bool again = at_end && samples == last;
  if (!again && (samples <= last || (!at_end && outline().frame_samples() < next))) {
    return false;
  }
  const FrameError frame = error_.update(film());
  const bool known = frame.known && method_has_error(spec().settings.method);
  if (known && again) {
    record_.history.back().rel_mse = frame.rel_mse;
    record_.history.back().half_width = frame.half_width;
  } else if (known) {
    record_.history.push_back({samples, record_.worker_seconds, frame.rel_mse, frame.half_width});
  }
  return known;
}

// ---- end ----

void Job::end_stored() {
  if (--ends_unstored_ == 0 && has_ended(state())) {
    shown_state_ = state();
    ++version_;
  }
}

// ---- rows ----

void Job::store(const Event& event) {
  ++version_;
  ends_unstored_ += has_ended(state()) ? 1 : 0;
  event.store(PutJob{record_});
}

void Job::store_progress(const Event& event) {
  ++version_;
  event.store(PutProgress{id(), active_seconds(event.now), record_.worker_seconds, record_.counters});
}

}  // namespace lightmill
