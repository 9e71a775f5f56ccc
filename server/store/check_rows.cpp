#include "server/store/check_rows.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/farm/film_rules.h"
#include "common/film/film.h"

namespace lightmill {
namespace {

/// Longer than any job has been rendered, in seconds; sums of such times stay exact.
constexpr double kMaxStoredSeconds = 1e12;

bool is_time(double seconds) {
  return seconds >= 0 && seconds <= kMaxStoredSeconds;
}

Status check_record(const JobRecord& record) {
  const JobSpec& spec = record.spec;
  LM_RETURN_IF_ERROR(check_film(spec.settings));
  if (spec.goal.samples > kMaxSamples || !(spec.goal.seconds >= 0 && spec.goal.seconds <= kMaxGoalSeconds) ||
      !(spec.goal.error >= 0 && std::isfinite(spec.goal.error)) ||
      !(spec.verify_share >= 0 && spec.verify_share <= 1)) {
    return invalid_argument("its goal is {} samples, {} seconds, error {}, of which {} are verified", spec.goal.samples,
                            spec.goal.seconds, spec.goal.error, spec.verify_share);
  }
  // What threads took is the sum of what workers say.
  if (!is_time(record.active_seconds) || !(record.worker_seconds >= 0 && std::isfinite(record.worker_seconds))) {
    return invalid_argument("it was rendered for {} s, by threads that took {} s", record.active_seconds,
                            record.worker_seconds);
  }
  if (const std::size_t shares = record.allocation.shifts().size();
      shares != 0 && shares != grid_of(spec.settings).tile_count()) {
    return invalid_argument("{} tiles have shares of its samples", shares);
  }
  return ok_status();
}

/// That the samples are ones that a film can have.
Status check_range(const SampleRange& range) {
  return range.level <= kMaxRangeLevel && range.end() <= kMaxSamples
             ? ok_status()
             : invalid_argument("a range of samples is number {} of level {}", range.index, range.level);
}

Status check_nodes(const StoredState::StoredJob& job) {
  const RenderSettings& settings = job.record.spec.settings;
  const Film film(grid_of(settings), NodeLayout(settings.layers), job.record.allocation);
  std::map<TileId, std::vector<SampleRange>> forests;
  for (const StoredState::StoredNode& stored : job.nodes) {
    const Node& node = *stored.node;
    if (stored.tile.value >= film.grid().tile_count()) {
      return invalid_argument("a node is of tile {} of {}", stored.tile.value, film.grid().tile_count());
    }
    LM_RETURN_IF_ERROR(check_range(node.range));
    if (const std::size_t expected = film.expected_values(stored.tile, node.range); node.values.size() != expected) {
      return invalid_argument("a node of tile {} has {} values instead of {}", stored.tile.value, node.values.size(),
                              expected);
    }
    forests[stored.tile].push_back(node.range);
  }
  for (auto& [tile, ranges] : forests) {
    std::ranges::sort(ranges, {}, &SampleRange::first);
    for (std::size_t i = 1; i < ranges.size(); ++i) {
      if (ranges[i].first() < ranges[i - 1].end()) {
        return invalid_argument("tile {} has sample {} twice", tile.value, ranges[i].first());
      }
    }
  }
  for (const StoredState::StoredResult& result : job.results) {
    if (result.tile.value >= film.grid().tile_count()) {
      return invalid_argument("a result is of tile {} of {}", result.tile.value, film.grid().tile_count());
    }
    LM_RETURN_IF_ERROR(check_range(result.range));
  }
  return ok_status();
}

}  // namespace

Status check_stored(const StoredState& state) {
  if (state.epoch == 0 || state.epoch >= std::uint64_t{1} << 32) {
    return data_loss("the store is damaged: its epoch is {}", state.epoch);
  }
  for (const StoredState::StoredJob& job : state.jobs) {
    Status status = check_record(job.record);
    if (status.ok()) {
      status = check_nodes(job);
    }
    if (!status.ok()) {
      return data_loss("the store is damaged: job {}: {}", job.record.id.value,
                       message_of(status));
    }
  }
  return ok_status();
}

}  // namespace lightmill
