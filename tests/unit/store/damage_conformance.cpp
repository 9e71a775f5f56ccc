// Conformance tests of stores: damaged rows are left out, and named.
#include "tests/unit/store/store_conformance.h"

namespace lightmill::test {

TEST_P(StoreConformance, ADamagedNodeOfAnEndedJobIsLeftOutWhenRead) {
  JobRecord ended = full_record(1);
  ended.state = JobState::done;
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{ended}, PutNode{JobId{1}, TileId{0}, small_node(0, 0, 1)},
                    PutNode{JobId{1}, TileId{1}, small_node(0, 0, 2)}});
  }
  place_->damage_tile(0);
  const auto store = open();
  const StoredState state = store->load().value();
  EXPECT_TRUE(state.damaged.empty());
  EXPECT_EQ(state.jobs.at(0).nodes.size(), 2u);
  const FilmPiece piece = store->read_film(JobId{1}, {}).value();
  ASSERT_EQ(piece.nodes.size(), 1u);
  EXPECT_EQ(piece.nodes[0].tile, TileId{1});
}

TEST_P(StoreConformance, ADamagedNodeIsLeftOutAndTheOthersStay) {
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{full_record(1)}, PutNode{JobId{1}, TileId{0}, small_node(0, 0, 1)},
                    PutNode{JobId{1}, TileId{1}, small_node(0, 0, 2)}});
  }
  place_->damage_tile(0);
  {
    const auto store = open();
    const StoredState state = loaded(*store);
    ASSERT_EQ(state.jobs.at(0).nodes.size(), 1u);
    EXPECT_EQ(state.jobs[0].nodes[0].tile.value, 1u);
    EXPECT_EQ(state.damaged, (std::vector<NodeKey>{{JobId{1}, TileId{0}, {0, 0}}}));
    EXPECT_TRUE(store->check_structure().ok());
    // The node is also gone from the store, so the same range can be stored again.
    commit(*store, {PutNode{JobId{1}, TileId{0}, small_node(0, 0, 1)}});
  }
  const StoredState again = loaded(*open());
  EXPECT_EQ(again.jobs.at(0).nodes.size(), 2u);
  EXPECT_TRUE(again.damaged.empty());
}

TEST_P(StoreConformance, AnAlteredJobIsLeftOut) {
  const auto left_out = [&] {
    const StoredState state = loaded(*open());
    EXPECT_EQ(state.next_job_id, 4u);
    EXPECT_EQ(state.jobs.size() + state.damaged_jobs.size(), 2u);
    return state.damaged_jobs;
  };
  {
    const auto store = open();
    loaded(*store);
    JobRecord zeros = full_record(3);
    zeros.spec.goal.seconds = zeros.spec.goal.error = zeros.spec.audit_share = -0.0;  // which SQLite keeps as 0
    commit(*store, {PutJob{full_record(1)}, PutJob{zeros}, PutNode{JobId{1}, TileId{0}, small_node(0, 0, 1)}});
  }
  EXPECT_TRUE(left_out().empty());
  for (const auto& [table, key] : {std::pair{"jobs", "id"}, std::pair{"job_specs", "job"}}) {
    for (const char* const change : {"checksum = checksum + 1", "checksum = 0", "message = substr(message, 2)"}) {
      place_->update(table, fmt::format("{} WHERE {} = 1", change, key));
      EXPECT_EQ(left_out(), std::vector{JobId{1}}) << table << ": " << change;
      commit(*open(), {DeleteJobRows{JobId{1}}});
      commit(*open(), {PutJob{full_record(1)}});
    }
  }
}

TEST_P(StoreConformance, DamagedProgressStartsAgainAndIsNamed) {
  JobRecord record = full_record(1);
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{record}});
  }
  place_->update("job_progress", "checksum = checksum + 1");
  record.active_seconds = record.worker_seconds = 0;
  record.counters = {};
  StoredState expected;
  expected.next_job_id = 2;
  expected.jobs.push_back({record, {}});
  const StoredState state = loaded(*open());
  EXPECT_EQ(describe(state), describe(expected));
  EXPECT_EQ(state.damaged_entries,
            std::vector<std::string>{"job 1: its times and counters are damaged and begin at 0"});
  EXPECT_TRUE(loaded(*open()).damaged_entries.empty()) << "they are written again";
}

TEST_P(StoreConformance, ADamagedQuarantineStaysInForce) {
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutQuarantine{{{"liar", "machine"}, "wrong", 5}}});
  }
  place_->update("quarantine", "message = substr(message, 2)");
  const StoredState state = loaded(*open());
  ASSERT_EQ(state.quarantine.size(), 1u);
  EXPECT_EQ(state.quarantine[0].of.worker, "liar");
  ASSERT_EQ(state.damaged_entries.size(), 1u);
  EXPECT_TRUE(state.damaged_entries[0].starts_with("worker liar stays in quarantine")) << state.damaged_entries[0];
  const StoredState again = loaded(*open());
  EXPECT_EQ(again.quarantine, state.quarantine);
  EXPECT_TRUE(again.damaged_entries.empty()) << "it is written again";
}

TEST_P(StoreConformance, OnlyTheDamagedRecordOfAResultIsDropped) {
  const NodeKey left{JobId{1}, TileId{0}, {0, 0}}, right{JobId{1}, TileId{0}, {0, 1}},
      other{JobId{1}, TileId{1}, {0, 0}};
  const auto put = [](const NodeKey& key) { return PutResult{key, Hash128{1, 2}, {"worker", "machine"}, true}; };
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{full_record(1)}, put(left), put(right), put(other)});
    commit(*store, {PutAudited{other}});
  }
  EXPECT_EQ(loaded(*open()).jobs.at(0).results.size(), 3u);
  const std::vector<std::pair<std::string, DropResultRow>> changes{
      {"worker = 'innocent'", {JobId{1}, 0, 0, 1}},
      {"level = 20, range_index = 0", {JobId{1}, 0, 20, 0}},  // all others would lie within it
      {"level = 2147483700", {JobId{1}, 0, 2147483700, 1}},
      {"level = -3", {JobId{1}, 0, -3, 1}},
      {"tile = 4294967297, range_index = 0", {JobId{1}, 4294967297, 0, 0}},  // the range of `other`, in 32 bits
      {"tile = -1", {JobId{1}, -1, 0, 1}},
      {"range_index = 4294967297", {JobId{1}, 0, 0, 4294967297}},  // its own range in 32 bits, which its checksum fits
      {"audit = 2", {JobId{1}, 0, 0, 1}},                          // it would never be rendered again
      {"audit = audit | (checksum & 2147483640)", {JobId{1}, 0, 0, 1}},  // its checksum fits
      {"checksum = 0", {JobId{1}, 0, 0, 1}}};
  for (const auto& [change, row] : changes) {
    place_->update("results", change + " WHERE tile = 0 AND level = 0 AND range_index = 1");
    EXPECT_EQ(loaded(*open()).damaged_results, std::vector{row}) << change;
    const StoredState after = loaded(*open());
    EXPECT_TRUE(after.damaged_results.empty()) << change << ": it is gone from the store too";
    EXPECT_EQ(after.jobs.at(0).results.size(), 2u) << change;
    commit(*open(), {put(right)});
  }
  // A row that stays damaged does not keep others from being dropped.
  place_->update("results", "level = -3 WHERE tile = 0 AND range_index = 1");
  commit(*open(), {DropResults{{JobId{1}, TileId{0}, {3, 0}}}});
}

}  // namespace lightmill::test
