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
    place_->update(table, fmt::format("message = substr(message, 2) WHERE {} = 1", key));
    EXPECT_EQ(left_out(), std::vector{JobId{1}}) << table;
    EXPECT_EQ(left_out(), std::vector{JobId{1}}) << table << ": its nodes still count";
    commit(*open(), {DeleteJobRows{JobId{1}}});
    commit(*open(), {PutJob{full_record(1)}, PutNode{JobId{1}, TileId{0}, small_node(0, 0, 1)}});
  }
}

TEST_P(StoreConformance, DamagedProgressStartsAgainAndIsNamed) {
  JobRecord record = full_record(1);
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{record}});
  }
  place_->update("job_progress", "message = substr(message, 2)");
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

TEST_P(StoreConformance, ADamagedRecordOfAResultIsDropped) {
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
    // If its place or checksum is damaged, others may be lost, too.
    const bool alone = change.starts_with("worker") || change.starts_with("audit");
    EXPECT_EQ(after.jobs.at(0).results.size(), alone ? 2u : 0u) << change;
    commit(*open(), {put(left), put(right), put(other)});
  }
  // A row that stays damaged does not keep others from being dropped.
  place_->update("results", "level = -3 WHERE tile = 0 AND range_index = 1");
  commit(*open(), {DropResults{{JobId{1}, TileId{0}, {3, 0}}}});
}

// ---- rows that are lost, left over, or of an earlier commit ----

/// A table, its key, and the columns that a write replaces.
struct TableColumns {
  std::string table, key, values;
};
const std::vector<TableColumns> kSmallTables{{"jobs", "id", "message, checksum"},
                                             {"job_specs", "job", "message, checksum"},
                                             {"job_progress", "job", "message, checksum"},
                                             {"tokens", "id", "message, checksum"},
                                             {"quarantine", "worker", "message, checksum"}};
const std::vector<TableColumns> kFilmTables{
    {"nodes", "job, tile, level, range_index", "non_finite, hash, samples"},
    {"results", "job, tile, level, range_index", "hash, worker, machine, audit, fingerprint_class, checksum"}};
const NodeKey kFirst{JobId{1}, TileId{0}, {0, 0}};

/// Writes of a job with a pilot and a row in each other table. `version` changes each row but that of the log.
std::vector<StoreOp> writes_of_version(int version) {
  JobRecord record = full_record(1);
  record.state = JobState::running;
  record.method_notes.candidates = version == 1 ? std::vector<std::string>{"path"} : std::vector<std::string>{};
  record.reason = fmt::format("version {}", version);
  record.active_seconds = version;
  Action action;
  action.number = 1;
  return {PutJob{record},
          PutNode{kFirst.job, kFirst.tile, small_node(0, 0, static_cast<float>(version))},
          PutResult{kFirst, Hash128{1, static_cast<std::uint64_t>(version)}, {"worker", "machine"}},
          PutToken{{"t", fmt::format("name {}", version), Roles::all(), {}, "root", 1, 2}},
          PutAction{action},
          PutQuarantine{{{"liar", "machine"}, fmt::format("reason {}", version), 5}}};
}

/// Copies the table to KEPT, or back.
std::string copy_of(const TableColumns& each, const std::string& kept) {
  return fmt::format("CREATE TABLE {} AS SELECT * FROM {}", kept, each.table);
}
std::string put_back(const TableColumns& each, const std::string& kept) {
  return fmt::format("UPDATE {0} SET ({2}) = (SELECT {2} FROM {3} AS kept WHERE ({1}) = (SELECT {1} FROM {0}))",
                     each.table, each.key, each.values, kept);
}

TEST_P(StoreConformance, ASmallRowOfAnEarlierCommitIsRefused) {
  for (const int version : {1, 2}) {
    commit(*open(), writes_of_version(version));
    for (const TableColumns& each : kSmallTables) {
      place_->execute(copy_of(each, fmt::format("{}_{}", each.table, version)));
    }
  }
  for (const TableColumns& each : kSmallTables) {
    place_->execute(put_back(each, each.table + "_1"));
    expect_refused(fmt::format("its table {} has lost rows, or has rows of an earlier commit", each.table));
    place_->execute(put_back(each, each.table + "_2"));
    EXPECT_TRUE(open()->load()->damaged.empty()) << each.table;
  }
}

TEST_P(StoreConformance, ASmallRowThatIsLostIsRefused) {
  commit(*open(), writes_of_version(1));
  for (const TableColumns& each : kSmallTables) {
    if (each.table == "jobs") {
      continue;  // PostgreSQL would delete the job's other rows
    }
    place_->execute(copy_of(each, "kept") + "; DELETE FROM " + each.table);
    expect_refused(fmt::format("its table {} has lost rows", each.table));
    place_->execute(fmt::format("INSERT INTO {} SELECT * FROM kept; DROP TABLE kept", each.table));
    EXPECT_TRUE(open()->load()->damaged.empty()) << each.table;
  }
}

TEST_P(StoreConformance, ASmallRowThatWasDroppedAndIsBackIsRefused) {
  for (const auto& [op, table] : std::vector<std::pair<StoreOp, std::string>>{
           {DropToken{"t"}, "tokens"}, {DropAction{1}, "actions"}, {DropQuarantine{"liar"}, "quarantine"}}) {
    commit(*open(), writes_of_version(1));
    place_->execute(fmt::format("CREATE TABLE kept AS SELECT * FROM {}", table));
    commit(*open(), {op});
    EXPECT_TRUE(open()->load().ok()) << table;
    place_->execute(fmt::format("INSERT INTO {} SELECT * FROM kept; DROP TABLE kept", table));
    expect_refused(fmt::format("its table {} has lost rows, or has rows of an earlier commit", table));
    loaded(*open_accepting_loss());
    EXPECT_TRUE(open()->load().ok()) << table << ": the loss was accepted once";
  }
}

TEST_P(StoreConformance, ADeletedJobThatIsBackIsRefused) {
  std::string keep, bring_back;
  for (const char* const table : {"jobs", "job_specs", "job_progress", "nodes", "results"}) {
    keep += fmt::format("CREATE TABLE kept_{0} AS SELECT * FROM {0}; ", table);
    bring_back += fmt::format("INSERT INTO {0} SELECT * FROM kept_{0}; ", table);
  }
  commit(*open(), writes_of_version(1));
  place_->execute(keep);
  commit(*open(), {DeleteJobRows{kFirst.job}});
  EXPECT_TRUE(open()->load()->jobs.empty());
  place_->execute(bring_back);
  expect_refused("its tables jobs, job_specs, job_progress have lost rows, or have rows of an earlier commit");
}

TEST_P(StoreConformance, ATileWithARowOfAnEarlierCommitIsRenderedAgain) {
  for (const TableColumns& each : kFilmTables) {
    commit(*open(), writes_of_version(1));
    place_->execute(copy_of(each, "kept"));
    commit(*open(), writes_of_version(2));
    EXPECT_TRUE(loaded(*open()).damaged.empty()) << each.table;
    place_->execute(put_back(each, "kept") + "; DROP TABLE kept");
    const StoredState state = loaded(*open());
    EXPECT_EQ(state.damaged, std::vector{kFirst}) << each.table;
    EXPECT_TRUE(state.jobs.at(0).nodes.empty() && state.jobs[0].results.empty()) << each.table;
    EXPECT_TRUE(loaded(*open()).damaged.empty()) << each.table << ": it is gone from the store too";
  }
}

TEST_P(StoreConformance, ATileWithARowThatIsLostOrBackIsRenderedAgain) {
  for (const auto& [op, each] : std::vector<std::pair<StoreOp, TableColumns>>{{DropNode{kFirst}, kFilmTables[0]},
                                                                              {DropResults{kFirst}, kFilmTables[1]}}) {
    commit(*open(), writes_of_version(1));
    place_->execute(copy_of(each, "kept") + "; DELETE FROM " + each.table);
    EXPECT_EQ(loaded(*open()).damaged, std::vector{kFirst}) << each.table << " lost";
    EXPECT_TRUE(loaded(*open()).damaged.empty()) << each.table;
    commit(*open(), writes_of_version(1));
    commit(*open(), {op});
    place_->execute(fmt::format("INSERT INTO {} SELECT * FROM kept; DROP TABLE kept", each.table));
    EXPECT_EQ(loaded(*open()).damaged, std::vector{kFirst}) << each.table << " back";
    EXPECT_TRUE(loaded(*open()).damaged.empty()) << each.table;
  }
}

TEST_P(StoreConformance, SumsOverRowsFollowEachWrite) {
  const JobId one{1}, two{2};
  const auto put = [](JobId job, SampleRange range, std::uint64_t hash, bool audit) {
    return PutResult{{job, TileId{0}, range}, Hash128{hash, 1}, {"worker", "machine"}, audit};
  };
  const std::vector<std::vector<StoreOp>> commits{
      {PutJob{full_record(1)}, PutJob{full_record(2)}, PutNode{one, TileId{0}, small_node(0, 0, 1)},
       put(one, {0, 0}, 1, true), put(two, {0, 1}, 2, true), put(two, {0, 2}, 3, false)},
      {PutNode{one, TileId{0}, small_node(0, 0, 2)}, put(one, {0, 0}, 4, true)},
      {PutAudited{{one, TileId{0}, {0, 0}}}, PutAudited{{one, TileId{7}, {0, 0}}}},
      {DropResults{{two, TileId{0}, {2, 0}}}, DropResults{{two, TileId{0}, {2, 0}}}},
      {DropNode{{one, TileId{0}, {0, 0}}}, DropNode{{one, TileId{0}, {0, 0}}}, DropResultRow{one, 0, 0, 0}},
      {PutNode{one, TileId{0}, small_node(0, 0, 3)}, put(one, {0, 0}, 5, false), PutProgress{one, 1, 2, {}}},
      {DeleteJobRows{one}, DeleteJobRows{one}, DeleteJobRows{JobId{77}}},
      {DropToken{"unknown"}, DropAction{5}, DropQuarantine{"unknown"}}};
  for (std::size_t i = 0; i < commits.size(); ++i) {
    commit(*open(), commits[i]);
    const Result<StoredState> state = open()->load();
    ASSERT_TRUE(state.ok()) << "commit " << i << ": " << state.status();
    EXPECT_TRUE(state->damaged.empty()) << "commit " << i;
  }
  const std::vector<StoreOp> fails{PutJob{full_record(3)}, PutNode{JobId{99}, TileId{0}, small_node(0, 0, 1)}};
  const auto store = open();
  EXPECT_FALSE(store->commit(fails).ok());
  commit(*store, {PutJob{full_record(4)}});
  EXPECT_TRUE(store->load()->damaged.empty()) << "a failed commit changes no sum";
}

}  // namespace lightmill::test
