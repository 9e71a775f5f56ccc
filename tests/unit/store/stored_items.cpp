#include "tests/unit/store/stored_items.h"

#include <gtest/gtest.h>

#include "common/film/film.h"
#include "tests/unit/store/stored_examples.h"

namespace lightmill::test {
namespace {

JobRecord job_of_four_tiles(std::uint64_t id, const PixelRect& crop) {
  JobRecord record = full_record(id);
  RenderSettings& settings = record.spec.settings;
  settings.width = settings.height = 128;
  settings.crop = crop;
  settings.layers = {LayerSpec{}};
  settings.meters = 0;
  settings.method = "path";
  record.allocation = {};
  return record;
}

PutNode node_of(const JobRecord& job, std::uint32_t tile) {
  const RenderSettings& settings = job.spec.settings;
  const Film film(grid_of(settings), NodeLayout(settings.layers));
  auto node = std::make_shared<Node>();
  node->values.assign(film.expected_values(TileId{tile}, node->range), static_cast<float>(10 * job.id.value + tile));
  return {job.id, TileId{tile}, std::move(node)};
}

}  // namespace

std::vector<StoreOp> writes_of_job(std::uint64_t id, const PixelRect& crop) {
  const JobRecord job = job_of_four_tiles(id, crop);
  std::vector<StoreOp> ops{PutJob{job}};
  for (std::uint32_t tile = 0; tile < 4; ++tile) {
    ops.push_back(node_of(job, tile));
    ops.push_back(PutResult{{JobId{id}, TileId{tile}, {0, 0}}, Hash128{id, tile}, {"worker", "machine"}, tile == 1});
  }
  Action action;
  action.number = id;
  action.caller = "ada";
  ops.push_back(PutAction{action});
  ops.push_back(PutToken{{fmt::format("token {}", id), "ada", Roles::all(), sha256("t"), "root", 1, 2'000'000'000}});
  ops.push_back(PutQuarantine{{{fmt::format("liar {}", id), "machine"}, "wrong", 5}});
  return ops;
}

std::map<std::string, std::string> items_of(const StoredState& state) {
  std::map<std::string, std::string> items;
  for (const StoredState::StoredJob& job : state.jobs) {
    const std::string name = fmt::format("job {}", job.record.id.value);
    StoredState alone;
    alone.renderers = state.renderers;
    alone.jobs.push_back({job.record, {}, {}});
    items[name] = describe(alone);
    for (const StoredState::StoredNode& node : job.nodes) {
      items[fmt::format("{} node of tile {}", name, node.tile.value)] = hash_of(*node.node).hex();
    }
    for (const StoredState::StoredResult& result : job.results) {
      items[fmt::format("{} result of tile {}", name, result.tile.value)] =
          fmt::format("{} {} {}", result.hash.hex(), state.renderers.at(result.by).worker, result.audit_pending);
    }
  }
  for (const TokenRecord& token : state.tokens) {
    items[token.id] = fmt::format("{} {} {}", token.name, names_of(token.roles), token.hash.hex());
  }
  for (const Action& action : state.actions) {
    items[fmt::format("action {}", action.number)] = action.caller;
  }
  for (const QuarantineRecord& record : state.quarantine) {
    items[record.of.worker] = record.reason + record.of.identity;
  }
  return items;
}

void expect_named(const StoredState& state, const std::map<std::string, std::string>& before) {
  const std::map<std::string, std::string> now = items_of(state);
  for (const auto& [item, value] : now) {
    const auto old = before.find(item);
    EXPECT_TRUE(old != before.end() && (old->second == value || !state.damaged_entries.empty())) << item << " is other";
  }
  for (const auto& [item, value] : before) {
    if (now.contains(item)) {
      continue;
    }
    bool named = !item.starts_with("job ") && !state.damaged_entries.empty();
    for (const JobId job : state.damaged_jobs) {
      named = named || (item + " ").starts_with(fmt::format("job {} ", job.value));
    }
    for (const NodeKey& key : state.damaged) {
      named = named || item == fmt::format("job {} node of tile {}", key.job.value, key.tile.value);
    }
    for (const DropResultRow& row : state.damaged_results) {
      named = named || item == fmt::format("job {} result of tile {}", row.job.value, row.tile);
    }
    // A vanished result takes along its node, which is named. Its samples are rendered again.
    named = named || (item.find(" result of ") != std::string::npos && !state.damaged.empty());
    EXPECT_TRUE(named) << item << " is gone";
  }
}

bool names_damage(const StoredState& state) {
  return !state.damaged.empty() || !state.damaged_jobs.empty() || !state.damaged_entries.empty() ||
         !state.damaged_results.empty();
}

}  // namespace lightmill::test
