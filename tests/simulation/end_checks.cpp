#include "tests/simulation/end_checks.h"

#include <algorithm>

#include "common/film/error_goal.h"
#include "tests/simulation/fake_renderer.h"
#include "tests/support/film_planes.h"

namespace lightmill::simulation {
namespace {

/// Largest relative difference of sums of some hundred samples that each differ in the last bit. Nearly always, one
/// sample adds more.
constexpr float kRounding = 0x1p-18f;

/// Equal, except for rounding.
bool are_near(std::span<const float> a, std::span<const float> b) {
  return std::ranges::equal(
      a, b, [](float one, float other) { return std::abs(one - other) <= kRounding * std::abs(other); });
}

}  // namespace

void EndChecks::check_job(const ClientJob& job) {
  const Result<JobStatus> status = server_.coordinator()->status(*job.id, world_.now);
  if (job.removed) {
    if (status.ok() || server_.disk().job(*job.id) != nullptr) {
      world_.fail(fmt::format("job {} was deleted, but still exists", job.id->value));
    }
    return;
  }
  if (!status.ok()) {
    world_.fail(fmt::format("job {} was submitted, but does not exist", job.id->value));
    return;
  }
  // LossChecks has checked the losses. A harmless job may fail too, if chance takes enough workers in a row.
  if (status->state == JobState::failed && status->reason.find(kLostInARow) != std::string::npos) {
    ++(job.poisoned_pilot || job.poison != kNoPoison ? world_.report.poisoned : world_.report.unlucky);
    return;
  }
  // RefusalChecks has checked who refused.
  if (status->state == JobState::failed && status->reason.find(job.broken ? kBroken : kSpite) != std::string::npos) {
    ++(job.broken ? world_.report.refused : world_.report.failed_by_liar);
    return;
  }
  const JobState expected = job.cancelled ? JobState::cancelled : JobState::done;
  if (status->state != expected) {
    world_.fail(fmt::format("job {} should be {}, but is not: {}", job.id->value, job.cancelled ? "cancelled" : "done",
                            status->reason));
    return;
  }
  check_film(job, *status);
  check_method(job);
}

void EndChecks::check() {
  for (const ClientJob& job : clients_.jobs()) {
    check_job(job);
  }
  for (const SimulatedWorker& worker : workers_) {
    if (worker.alive && world_.now >= worker.hung_until) {
      const SessionStatus status = worker.session->status();
      if (status.results_unacknowledged > 0 || status.unacknowledged_bytes > 0 || status.leases > 0 ||
          status.tiles_queued > 0) {
        world_.fail(fmt::format("{} still holds {} leases and {} results", worker.name, status.leases,
                                status.results_unacknowledged));
      }
    }
  }
  for (const WorkerStatus& worker : server_.coordinator()->workers(world_.now)) {
    if (worker.leases > 0) {
      world_.fail(fmt::format("{} has {} leases at the end", worker.name, worker.leases));
    }
  }
}

void EndChecks::check_method(const ClientJob& job) {
  if (job.cancelled || job.notes.candidates.empty()) {
    return;
  }
  const RenderSettings& settings = (*server_.coordinator()->spec(*job.id))->settings;
  const std::string& expected = job.notes.candidates[pilot_choice(settings, job.notes.candidates.size())];
  for (const std::string& method : {settings.method, server_.disk().job(*job.id)->spec.settings.method}) {
    if (method != expected) {
      world_.fail(fmt::format("job {} was rendered by {} instead of {}", job.id->value, method, expected));
    }
  }
}

std::uint64_t EndChecks::count_of(const ClientJob& job, const JobStatus& status) const {
  const FilmOutline& film = *server_.coordinator()->outline(*job.id);
  const std::uint64_t first = first_error_count(film.allocation());
  for (std::uint64_t count = first; count < kMaxSamples; count = next_error_count(count + 1)) {
    Film quiet(film.grid(), film.layout(), film.allocation());
    for (std::uint32_t i = 0; i < film.grid().tile_count(); ++i) {
      const auto pixels = static_cast<std::size_t>(film.grid().tile_rect(TileId{i}).pixel_count());
      for (const NodePtr& node : shared_renderer().forest(
               status.render_digest, TileId{i}, film.allocation().of_tile(TileId{i}, count), pixels, film.layout())) {
        quiet.restore(TileId{i}, node);
      }
    }
    if (meets(ErrorEstimator().update_all(quiet), job.error)) {
      return count;
    }
  }
  return kMaxSamples;
}

bool EndChecks::may_be_rounded(const ClientJob& job) const {
  return job.spec.allow_mixed &&
         std::ranges::any_of(workers_, [](const SimulatedWorker& each) { return each.fingerprint != kUsualClass; });
}

bool EndChecks::is_right(const ClientJob& job, const JobStatus& status, TileId tile, const Node& node) const {
  const FilmOutline& film = *server_.coordinator()->outline(*job.id);
  const auto pixels = static_cast<std::size_t>(film.grid().tile_rect(tile).pixel_count());
  const NodePtr quiet = shared_renderer().node(status.render_digest, tile, node.range, pixels, film.layout());
  return node.values == quiet->values || (may_be_rounded(job) && are_near(node.values, quiet->values));
}

std::uint64_t EndChecks::check_results(JobId job, TileId tile) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> nodes, results;
  const auto append = [](auto& spans, const SampleRange& range) {
    if (spans.empty() || spans.back().second != range.first()) {
      spans.emplace_back(range.first(), range.end());
    }
    spans.back().second = range.end();
  };
  std::uint64_t end = 0, unaudited = 0;
  for (const auto& [first, node] : server_.disk().nodes(job, tile)) {
    append(nodes, node->range);
  }
  for (const auto& [range, by, audited] : server_.disk().results(job, tile)) {
    unaudited += audited ? 0 : 1;
    if (range.first() < end) {
      world_.fail(
          fmt::format("job {}, tile {}: two stored results have sample {}", job.value, tile.value, range.first()));
    }
    end = range.end();
    append(results, range);
  }
  if (nodes != results) {
    world_.fail(fmt::format("job {}, tile {}: the stored results are not those of the film", job.value, tile.value));
  }
  return unaudited;
}

void EndChecks::check_film(const ClientJob& job, const JobStatus& status) {
  const Film& film = server_.film_now(*job.id);
  const JobRecord& record = *server_.disk().job(*job.id);
  const bool by_time = !job.cancelled && record.reached == GoalLimit::seconds;
  const RenderSettings& settings = (*server_.coordinator()->spec(*job.id))->settings;
  const Allocation expected = job.spec.goal.adaptive ? pilot_allocation(settings) : Allocation();
  if (!job.cancelled && (film.allocation() != expected || record.allocation != expected)) {
    world_.fail(fmt::format("job {} has another allocation than its pilot found", job.id->value));
    return;
  }
  world_.report.results_duplicate += status.counters.results_duplicate;
  world_.report.unaudited += job.cancelled ? 0 : status.results_unaudited;
  world_.report.wanted += film.pixel_samples();
  std::uint64_t wanted = by_time ? record.spec.goal.samples : job.goal;
  if (job.error > 0 && (workers_.have_liars() || may_be_rounded(job))) {
    wanted = film.frame_samples();  // lies, or the last bits, also decide the count
  } else if (job.error > 0 && !job.cancelled) {
    wanted = std::min(count_of(job, status), job.goal > 0 ? job.goal : kMaxSamples);
  }
  if (by_time && (record.spec.goal.seconds != job.spec.goal.seconds || record.active_seconds < job.spec.goal.seconds)) {
    world_.fail(fmt::format("job {} ended by time after {} of {} s", job.id->value, record.active_seconds,
                            job.spec.goal.seconds));
    return;
  }
  if (status.min_tile_samples != film.min_samples() || status.max_tile_samples != film.max_samples() ||
      status.frame_samples != film.frame_samples() || status.samples_done != film.pixel_samples()) {
    world_.fail(fmt::format("job {} shows other counts than its film has", job.id->value));
    return;
  }
  std::uint64_t unaudited = 0;
  std::set<std::string> classes;
  for (std::uint32_t i = 0; i < film.grid().tile_count(); ++i) {
    const TileId tile{i};
    const std::uint64_t samples = film.samples(tile);
    const std::uint64_t part = film.allocation().of_tile(tile, wanted > 0 ? wanted : kMaxSamples);
    if (!job.cancelled && (by_time ? samples > part : samples != part)) {
      world_.fail(fmt::format("job {}, tile {} has {} samples instead of {}", job.id->value, i, samples, part));
      return;
    }
    if (!job.cancelled && samples == 0) {
      world_.fail(fmt::format("job {} is done, but tile {} is empty", job.id->value, i));
      return;
    }
    // The disk has the film that is in memory.
    const std::map<std::uint64_t, NodePtr>& stored = server_.disk().nodes(*job.id, tile);
    const bool equal = std::ranges::equal(film.forest(tile), stored, [](const NodePtr& node, const auto& entry) {
      return node->range == entry.second->range && node->values == entry.second->values;
    });
    if (!equal) {
      world_.fail(fmt::format("job {}, tile {}: the disk does not hold the film", job.id->value, i));
      return;
    }
    if (!server_.damaged().contains({*job.id, tile})) {  // records of damaged nodes' results stay stored
      unaudited += check_results(*job.id, tile);
    }
    for (const Disk::Result& result : server_.disk().results(*job.id, tile)) {
      classes.insert(result.by.fingerprint_class);
    }
    // Unaudited results of liars may be wrong, where the job reports such results or was cancelled.
    bool is_lied_about = false;
    for (const NodePtr& node : film.forest(tile)) {
      const bool may_lie = std::ranges::any_of(server_.disk().results(*job.id, tile), [&](const auto& result) {
        return node->range.contains(result.range) && is_of_lies(result.by.identity) && !result.audited;
      });
      is_lied_about = is_lied_about || may_lie;
      if (!may_lie && !is_right(job, status, tile, *node)) {
        world_.fail(
            fmt::format("job {}, tile {}: the node of samples [{}, {}) has other bytes than in the run without "
                        "faults, and no part of a liar",
                        job.id->value, i, node->range.first(), node->range.end()));
        return;
      }
    }
    if (job.cancelled || (is_lied_about && status.results_unaudited > 0)) {
      continue;
    }
    const NodeLayout& layout = film.layout();
    const auto pixels = static_cast<std::size_t>(film.grid().tile_rect(tile).pixel_count());
    const std::vector<NodePtr> quiet = shared_renderer().forest(status.render_digest, tile, samples, pixels, layout);
    const std::vector<float> sums = test::sums_of(film, tile);
    const std::vector<float> quiet_sums = sums_over(quiet, layout, pixels, layout.summed);
    const std::vector<float> first = first_over(film.forest(tile), layout, pixels).values,
                             quiet_first = first_over(quiet, layout, pixels).values;
    const bool same =
        std::memcmp(sums.data(), quiet_sums.data(), sums.size() * sizeof(float)) == 0 && first == quiet_first;
    if (!same && !(may_be_rounded(job) && are_near(sums, quiet_sums) && are_near(first, quiet_first))) {
      world_.fail(fmt::format("job {}, tile {}: its {} samples have other bytes than in the run without faults",
                              job.id->value, i, samples));
      return;
    }
  }
  world_.report.mixed += classes.size() > 1;
  if (!job.cancelled && job.spec.audit_share == 1 && server_.damaged().empty() &&
      unaudited != status.results_unaudited) {
    world_.fail(fmt::format("job {}: {} stored results are not audited, but it reports {}", job.id->value, unaudited,
                            status.results_unaudited));
  }
}

}  // namespace lightmill::simulation
