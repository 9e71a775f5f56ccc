#include "server/store/check_rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/base/log.h"
#include "common/farm/job_rules.h"
#include "common/film/film.h"
#include "server/store/row_values.h"

namespace lightmill {
namespace {

/// Seconds. Longer than any job takes; sums of such times stay exact.
constexpr double kMaxStoredSeconds = 1e12;

bool is_time(double seconds) {
  return seconds >= 0 && seconds <= kMaxStoredSeconds;
}

Status check_record(const JobRecord& record) {
  const JobSpec& spec = record.spec;
  LM_RETURN_IF_ERROR(check_film(spec.settings));
  LM_RETURN_IF_ERROR(check_goal(spec.goal));
  LM_RETURN_IF_ERROR(check_audit_share(spec.audit_share));
  // The threads' time is a sum of what workers reported, so it has no limit.
  if (!is_time(record.active_seconds) || !(record.worker_seconds >= 0 && std::isfinite(record.worker_seconds))) {
    return invalid_argument("its times are invalid: rendered for {} s, thread time {} s", record.active_seconds,
                            record.worker_seconds);
  }
  if (const std::size_t shares = record.allocation.shifts().size();
      shares != 0 && shares != grid_of(spec.settings).tile_count()) {
    return invalid_argument("its allocation has {} tiles, which is not the number of the film's tiles", shares);
  }
  if (record.state == JobState::done && record.reached == GoalLimit::none) {
    return invalid_argument("it is done, but no limit was reached");
  }
  return ok_status();
}

/// Checks that a film can have these samples.
Status check_range(const SampleRange& range) {
  return range.level <= kMaxRangeLevel && range.end() <= kMaxSamples
             ? ok_status()
             : invalid_argument("invalid sample range: number {} of level {}", range.index, range.level);
}

/// Whether the film can have this node.
bool is_of(const FilmOutline& film, TileId tile, const NodeOutline& node) {
  return tile.value < film.grid().tile_count() && check_range(node.range).ok() &&
         node.values == film.expected_values(tile, node.range);
}

/// Nodes of a tile whose sample ranges overlap. At least one of each pair has a damaged tile number.
std::set<const NodeOutline*> overlapping(std::vector<const NodeOutline*> nodes) {
  std::set<const NodeOutline*> found;
  std::ranges::sort(nodes, {}, [](const NodeOutline* node) { return node->range.first(); });
  for (std::size_t i = 1, widest = 0; i < nodes.size(); ++i) {
    if (nodes[i]->range.first() < nodes[widest]->range.end()) {
      found.insert({nodes[widest], nodes[i]});
    }
    widest = nodes[i]->range.end() > nodes[widest]->range.end() ? i : widest;
  }
  return found;
}

/// The nodes of a tile that have a sample without exactly one recorded result. The nodes share no samples.
std::set<const NodeOutline*> unrecorded(std::vector<const NodeOutline*> nodes, std::vector<SampleRange> results) {
  std::ranges::sort(nodes, {}, [](const NodeOutline* node) { return node->range.first(); });
  std::ranges::sort(results, {}, [](const SampleRange& range) { return range.first(); });
  std::map<const NodeOutline*, std::uint64_t> recorded;  // end of the samples with a result
  for (const NodeOutline* node : nodes) {
    recorded[node] = node->range.first();
  }
  std::set<const NodeOutline*> unsound;
  for (const SampleRange& result : results) {
    const auto after = std::ranges::upper_bound(nodes, result.first(), {},
                                                [](const NodeOutline* node) { return node->range.first(); });
    if (after == nodes.begin() || !(*(after - 1))->range.contains(result)) {
      continue;
    }
    std::uint64_t& end = recorded[*(after - 1)];
    if (result.first() != end) {
      unsound.insert(*(after - 1));
    }
    end = result.end();
  }
  for (const auto& [node, end] : recorded) {
    if (end != node->range.end()) {
      unsound.insert(node);
    }
  }
  return unsound;
}

void take_out_nodes(StoredState::StoredJob& job, StoredState& state, std::vector<StoreOp>& repairs) {
  const RenderSettings& settings = job.record.spec.settings;
  const FilmOutline film(grid_of(settings), NodeLayout(settings.layers), job.record.allocation);
  std::map<TileId, std::vector<const NodeOutline*>> forests;
  for (const StoredState::StoredNode& stored : job.nodes) {
    if (is_of(film, stored.tile, stored.outline)) {
      forests[stored.tile].push_back(&stored.outline);
    }
  }
  std::map<TileId, std::vector<SampleRange>> results;
  for (const StoredState::StoredResult& result : job.results) {
    if (check_range(result.range).ok()) {
      results[result.tile].push_back(result.range);
    }
  }
  std::set<const NodeOutline*> unsound;
  for (auto& [tile, nodes] : forests) {
    std::set<const NodeOutline*> twice = overlapping(nodes);
    std::erase_if(nodes, [&](const NodeOutline* node) { return twice.contains(node); });
    unsound.merge(twice);
    unsound.merge(unrecorded(nodes, std::move(results[tile])));
  }
  std::erase_if(job.nodes, [&](const StoredState::StoredNode& stored) {
    if (is_of(film, stored.tile, stored.outline) && !unsound.contains(&stored.outline)) {
      return false;
    }
    state.damaged.push_back({job.record.id, stored.tile, stored.outline.range});
    stored::log_damage(state.damaged.back());
    repairs.push_back(DropNode{state.damaged.back()});
    return true;
  });
  std::erase_if(job.results, [&](const StoredState::StoredResult& result) {
    if (result.tile.value < film.grid().tile_count() && check_range(result.range).ok()) {
      return false;
    }
    stored::leave_out_result({job.record.id, result.tile.value, result.range.level, result.range.index}, state,
                             repairs);
    return true;
  });
}

}  // namespace

Status remove_invalid_rows(StoredState& state, std::vector<StoreOp>& repairs) {
  if (state.epoch == 0 || state.epoch >= std::uint64_t{1} << 32) {
    return data_loss("the store is damaged: its epoch is {}", state.epoch);
  }
  std::erase_if(state.jobs, [&](const StoredState::StoredJob& job) {
    const Status status = check_record(job.record);
    if (!status.ok()) {
      spdlog::error("job {} is left out: its stored data is invalid: {}", job.record.id.value, message_of(status));
      state.damaged_jobs.push_back(job.record.id);
    }
    return !status.ok();
  });
  for (StoredState::StoredJob& job : state.jobs) {
    take_out_nodes(job, state, repairs);
  }
  return ok_status();
}

void report_lost_nodes(StoredState& state) {
  std::map<std::pair<JobId, TileId>, std::vector<SampleRange>> known;
  for (const StoredState::StoredJob& job : state.jobs) {
    for (const StoredState::StoredNode& stored : job.nodes) {
      known[{job.record.id, stored.tile}].push_back(stored.outline.range);
    }
  }
  for (const NodeKey& key : state.damaged) {
    if (check_range(key.range).ok()) {
      known[{key.job, key.tile}].push_back(key.range);
    }
  }
  for (const StoredState::StoredJob& job : state.jobs) {
    for (const StoredState::StoredResult& result : job.results) {
      std::vector<SampleRange>& ranges = known[{job.record.id, result.tile}];
      if (std::ranges::none_of(ranges, [&](const SampleRange& range) { return range.contains(result.range); })) {
        ranges.push_back(result.range);
        state.damaged.push_back({job.record.id, result.tile, result.range});
        stored::log_damage(state.damaged.back());
      }
    }
  }
}

}  // namespace lightmill
