#include "tests/unit/store/store_conformance.h"

#include <gtest/gtest.h>

#include "server/store/coalesce.h"
#include "server/store/load_state.h"

namespace lightmill::test {

StoredState StoreConformance::loaded(Store& store) {
  Result<StoredState> state = load_with_films(store);
  EXPECT_TRUE(state.ok()) << state.status();
  return state.ok() ? std::move(*state) : StoredState{};
}

void StoreConformance::commit(Store& store, const std::vector<StoreOp>& ops) {
  const Status status = store.commit(ops);
  EXPECT_TRUE(status.ok()) << status;
}

TEST_P(StoreConformance, StartsEmpty) {
  const StoredState state = loaded(*open());
  EXPECT_EQ(state.epoch, 1u);
  EXPECT_EQ(state.next_job_id, 1u);
  EXPECT_TRUE(state.jobs.empty());
}

TEST_P(StoreConformance, EpochsGrow) {
  for (std::uint64_t epoch = 1; epoch <= 3; ++epoch) {
    EXPECT_EQ(loaded(*open()).epoch, epoch);
  }
}

TEST_P(StoreConformance, AJobSurvivesARoundTrip) {
  StoredState expected;
  expected.next_job_id = 6;
  {
    const auto store = open();
    loaded(*store);
    std::vector<StoreOp> ops;
    for (const std::uint64_t id : {2, 5}) {
      JobRecord record = full_record(id);
      record.state = id == 2 ? JobState::cancelled : JobState::failed;
      record.spec.ends_with_page = id == 2;
      ops.push_back(PutJob{record});
      expected.jobs.push_back({record, {}});
    }
    commit(*store, ops);
  }
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

TEST_P(StoreConformance, ALaterRowReplacesAnEarlierOne) {
  JobRecord record = full_record(1);
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{record}});
    record.spec.goal.samples = 1000;
    record.spec.goal.error = 0.5;
    record.reached = GoalLimit::none;
    record.spec.priority = 9;
    record.state = JobState::running;
    record.reason = "";
    record.fingerprint_class = "fixed";
    record.counters.results_merged = 77;
    record.history.push_back({32, 4, 0.125, 0.01});
    commit(*store, {PutJob{record}});
    record.active_seconds = 12.5;
    record.worker_seconds = 25;
    record.counters = {90, 8, 7, 6, 5};
    commit(*store, {PutProgress{record.id, record.active_seconds, record.worker_seconds, record.counters}});
  }
  StoredState expected;
  expected.next_job_id = 2;
  expected.jobs.push_back({record, {}});
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

TEST_P(StoreConformance, ChosenMethodIsKept) {
  JobRecord record = full_record(1);
  record.spec.settings.method = "auto";
  record.method_notes = {true, {"two do"}, {}, {"path", "whitted"}};
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{record}});
    record.spec.settings.method = "whitted";
    record.method_notes = {true, {"two do", "it is the faster"}, {}, {}};
    commit(*store, {PutJob{record}});
    record.reason = "it continues";
    commit(*store, {PutJob{record}});
  }
  StoredState expected;
  expected.next_job_id = 2;
  expected.jobs.push_back({record, {}});
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

TEST_P(StoreConformance, ForestIsKept) {
  const JobId job{1};
  StoredState expected;
  expected.next_job_id = 2;
  expected.jobs.push_back(
      {full_record(1), {{TileId{0}, small_node(1, 0, 2.5f)}, {TileId{3}, small_node(0, 4, -1e-30f)}}});
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{full_record(1)}, PutNode{job, TileId{0}, small_node(0, 0, 1)}});
    commit(*store, {PutNode{job, TileId{3}, small_node(0, 4, -1e-30f)}, DropNode{{job, TileId{0}, {0, 0}}},
                    PutNode{job, TileId{0}, small_node(1, 0, 2.5f)},
                    PutResult{{job, TileId{0}, {0, 0}}, Hash128{3, 4}, {"worker", "machine", "class-b"}},
                    PutResult{{job, TileId{0}, {0, 1}}, Hash128{1, 2}, {"worker", "machine"}, true}});
  }
  expected.renderers = {{"worker", "machine"}, {"worker", "machine", "class-b"}};
  expected.jobs[0].results = {{TileId{0}, {0, 1}, Hash128{1, 2}, 0, true}, {TileId{0}, {0, 0}, Hash128{3, 4}, 1}};
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

/// A job of `tiles` tiles, each with a node of 96 KiB.
std::vector<StoreOp> writes_of_large_film(const JobRecord& record, std::uint32_t tiles) {
  std::vector<StoreOp> ops{PutJob{record}};
  for (TileId tile{0}; tile.value < tiles; ++tile.value) {
    auto node = std::make_shared<Node>();
    node->range = {2, 0};
    node->values.assign(64 * 64 * 6, static_cast<float>(tile.value + 1));
    ops.push_back(PutNode{record.id, tile, std::move(node)});
  }
  return ops;
}

TEST_P(StoreConformance, AnEndedJobsFilmIsReadSeparatelyInPieces) {
  constexpr std::uint32_t kTiles = 400;  // 37.5 MiB
  JobRecord ended = full_record(1), active = full_record(2);
  ended.state = JobState::done;
  active.state = JobState::paused;
  {
    const auto store = open();
    loaded(*store);
    commit(*store, writes_of_large_film(ended, kTiles));
    commit(*store, writes_of_large_film(active, 2));
  }
  const auto store = open();
  const StoredState state = store->load().value();
  ASSERT_EQ(state.jobs.size(), 2u);
  const auto& [done, unfinished] = std::tie(state.jobs[0], state.jobs[1]);
  ASSERT_EQ(done.nodes.size(), kTiles);
  for (const StoredState::StoredNode& node : done.nodes) {
    EXPECT_EQ(node.node, nullptr);
    EXPECT_EQ(node.outline, (NodeOutline{{2, 0}, 0, 64 * 64 * 6}));
  }
  ASSERT_EQ(unfinished.nodes.size(), 2u);
  EXPECT_NE(unfinished.nodes[0].node, nullptr);

  std::set<TileId> read;
  int pieces = 0;
  for (std::optional<FilmPosition> last = FilmPosition{}; last; ++pieces) {
    const FilmPiece piece = store->read_film(JobId{1}, *last).value();
    for (const StoredState::StoredNode& node : piece.nodes) {
      EXPECT_EQ(node.node->values.back(), static_cast<float>(node.tile.value + 1));
      EXPECT_TRUE(read.insert(node.tile).second) << "twice";
    }
    last = piece.last;
    // A commit between two pieces drops the last tile. The read skips and repeats nothing.
    commit(*store, {DropNode{{JobId{1}, TileId{kTiles - 1}, {2, 0}}},
                    PutNode{JobId{1}, TileId{0}, small_node(0, 8 + static_cast<std::uint32_t>(pieces), 1)}});
  }
  EXPECT_GT(pieces, 2);
  EXPECT_EQ(read.size(), kTiles - 1);
  EXPECT_FALSE(read.contains(TileId{kTiles - 1}));
  EXPECT_TRUE(store->read_film(JobId{77}, {})->nodes.empty());
}

TEST_P(StoreConformance, OperationsOfACommitKeepTheirOrder) {
  const JobId job{1};
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{full_record(1)}, PutNode{job, TileId{0}, small_node(0, 0, 1)},
                    DropNode{{job, TileId{0}, {0, 0}}}, PutNode{job, TileId{0}, small_node(0, 0, 2)}});
  }
  const StoredState state = loaded(*open());
  ASSERT_EQ(state.jobs.size(), 1u);
  ASSERT_EQ(state.jobs[0].nodes.size(), 1u);
  EXPECT_EQ(state.jobs[0].nodes[0].node->values[0], 2.0f);
}

TEST_P(StoreConformance, DeleteForgetsAllButTheId) {
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutJob{full_record(8)}, PutNode{JobId{8}, TileId{0}, small_node(0, 0, 1)},
                    PutResult{{JobId{8}, TileId{0}, {0, 0}}, Hash128{1, 2}, {"worker", ""}}});
    commit(*store, {DeleteJobRows{JobId{8}}});
  }
  const StoredState state = loaded(*open());
  EXPECT_TRUE(state.jobs.empty());
  EXPECT_EQ(state.next_job_id, 9u) << "ids are never used again";
}

TEST_P(StoreConformance, TokensAreKeptUntilTheyAreDropped) {
  const TokenRecord one{"00112233aabb", "ada 'x' näme", {Role::view, Role::submit}, sha256("one"), "root", 1,
                        1'900'000'000};
  const TokenRecord two{
      "ffeeddccbbaa", "w", Roles::all(), sha256("two"), "", 3, 5'000'000'000, {4'000'000'000, 3, 1L << 40}, one.id};
  StoredState expected;
  {
    const auto store = open();
    loaded(*store);
    TokenRecord before = one;
    before.name = "another";
    before.hash = sha256("another");
    commit(*store, {PutToken{before}, PutToken{two}});
    commit(*store, {PutToken{one}});
    expected.tokens = {one, two};
    EXPECT_EQ(describe(loaded(*store)), describe(expected));
    commit(*store, {DropToken{two.id}, DropToken{"000000000000"}});
  }
  expected.tokens = {one};
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
  // A damaged token admits no caller, and other tokens stay valid.
  for (const char* const damage : {"checksum = checksum + 1", "message = substr(message, 2)"}) {
    commit(*open(), {DropToken{one.id}, PutToken{two}});
    place_->update("tokens", damage);
    commit(*open(), {PutToken{one}});
    const StoredState state = loaded(*open());
    EXPECT_EQ(describe(state), describe(expected)) << damage;
    ASSERT_EQ(state.damaged_entries.size(), 1u) << damage;
    EXPECT_TRUE(state.damaged_entries[0].starts_with("token ffeeddccbbaa is no longer valid"));
    EXPECT_TRUE(loaded(*open()).damaged_entries.empty()) << "it is gone from the store too";
  }
}

TEST_P(StoreConformance, ActionsAreKeptUntilTheyAreDroppedAndNeverChange) {
  const Action one{7,
                   1'700'000'000'123,
                   "ada 'x' näme",
                   Proof::certificate,
                   "",
                   "[::1]:4711",
                   "CancelJob",
                   0xfedcba9876543210u,
                   "",
                   StatusCode::kOk,
                   "",
                   "state running -> cancelled, nöte"};
  const Action two{8, -5, "", Proof::none, "", "", "Work", 0, "w1", StatusCode::kPermissionDenied, "not\nyou"};
  const Action three{9, 1, "ci", Proof::token, "00112233aabb", "h", "Start", 0, "", StatusCode::kOk, ""};
  StoredState expected;
  {
    const auto store = open();
    loaded(*store);
    commit(*store, {PutAction{one}, PutAction{two}});
    Action again = one;
    again.caller = "eve";
    commit(*store, {PutAction{again}, PutAction{three}});
    expected.actions = {one, two, three};
    EXPECT_EQ(describe(loaded(*store)), describe(expected));
    commit(*store, {DropAction{8}, DropAction{1}});
  }
  expected.actions = {one, three};
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
  place_->update("actions", "checksum = checksum + 1 WHERE number = 9");
  const StoredState state = loaded(*open());
  expected.actions = {one};
  EXPECT_EQ(describe(state), describe(expected));
  EXPECT_EQ(state.damaged_entries.size(), 1u);
  EXPECT_TRUE(loaded(*open()).damaged_entries.empty()) << "it is gone from the store too";
}

TEST_P(StoreConformance, ResultsAreKeptUntilTheyAreDropped) {
  const JobId one{1}, two{2};
  const auto result = [](JobId job, std::uint32_t tile, SampleRange range, const char* worker, bool audit_pending) {
    return PutResult{{job, TileId{tile}, range}, Hash128{range.level, range.index}, {worker, "m'1"}, audit_pending};
  };
  StoredState expected;
  expected.next_job_id = 3;
  expected.renderers = {{"a", "m'1"}, {"b", "m'1"}};
  expected.jobs = {{full_record(1), {}}, {full_record(2), {}}};
  {
    const auto store = open();
    loaded(*store);
    commit(*store,
           {PutJob{full_record(1)}, PutJob{full_record(2)}, result(one, 0, {2, 0}, "a", true),
            result(one, 0, {0, 4}, "b", true), result(one, 0, {1, 3}, "b", false), result(one, 0, {3, 1}, "a", true),
            result(one, 5, {0, 4}, "a", false), result(two, 0, {0, 4}, "b", true)});
    // [4, 5) and [6, 8) of the tile lie within [4, 8). [0, 4) and [8, 16) do not.
    commit(*store, {PutAudited{{one, TileId{0}, {3, 1}}}, DropResults{{one, TileId{0}, {2, 1}}}});
  }
  expected.jobs[0].results = {{TileId{0}, {2, 0}, Hash128{2, 0}, 0, true},
                              {TileId{0}, {3, 1}, Hash128{3, 1}, 0, false},
                              {TileId{5}, {0, 4}, Hash128{0, 4}, 0, false}};
  expected.jobs[1].results = {{TileId{0}, {0, 4}, Hash128{0, 4}, 1, true}};
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

TEST_P(StoreConformance, QuarantineIsKeptUntilItEnds) {
  const QuarantineRecord one{{"a 'x'", "machine"}, "wrong", 1'700'000'000'123}, two{{"b", ""}, "as wrong", 2};
  StoredState expected;
  {
    const auto store = open();
    EXPECT_NE(loaded(*store).secret, Sha256{});
    commit(*store, {PutQuarantine{{{"a 'x'", "another"}, "before", 1}}, PutQuarantine{two}});
    commit(*store, {PutQuarantine{one}});
    expected.quarantine = {one, two};
    EXPECT_EQ(describe(loaded(*store)), describe(expected));
    commit(*store, {DropQuarantine{"b"}, DropQuarantine{"unknown"}});
  }
  expected.quarantine = {one};
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

TEST_P(StoreConformance, FailedCommitLeavesNothing) {
  {
    const auto store = open();
    loaded(*store);
    const std::vector<StoreOp> ops{PutJob{full_record(1)}, PutNode{JobId{99}, TileId{0}, small_node(0, 0, 1)}};
    EXPECT_FALSE(store->commit(ops).ok()) << "a node of a job that does not exist";
    commit(*store, {PutJob{full_record(2)}});
  }
  const StoredState state = loaded(*open());
  ASSERT_EQ(state.jobs.size(), 1u);
  EXPECT_EQ(state.jobs[0].record.id.value, 2u);
}

TEST_P(StoreConformance, CoalescingChangesNothing) {
  // A small random history: jobs come, change and go; nodes are put, dropped and put again.
  std::uint64_t random_state = 12345;
  const auto random = [&](std::uint64_t below) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (random_state >> 33) % below;
  };
  const auto plain = open();
  const std::unique_ptr<StorePlace> other_place = GetParam().make();
  const auto other = other_place->open();
  loaded(*plain);
  loaded(*other);
  std::set<std::uint64_t> jobs;
  std::set<NodeKey> nodes;
  for (int round = 0; round < 60; ++round) {
    std::vector<StoreOp> ops;
    for (int i = 0; i < 20; ++i) {
      const std::uint64_t job = 1 + random(4);
      const NodeKey key{JobId{job}, TileId{0}, {static_cast<std::uint32_t>(random(2)), 0}};
      if (!jobs.contains(job) || random(4) == 0) {
        JobRecord record = full_record(job);
        record.counters.results_merged = random(1000);
        ops.push_back(PutJob{record});
        jobs.insert(job);
      } else if (random(4) == 0) {
        ops.push_back(
            PutProgress{JobId{job}, 1.0, static_cast<double>(random(100)), {random(1000), 0, 0, 0, 0, random(9), 0}});
      } else if (random(10) == 0) {
        ops.push_back(DeleteJobRows{JobId{job}});
        jobs.erase(job);
        std::erase_if(nodes, [&](const NodeKey& each) { return each.job.value == job; });
      } else if (nodes.erase(key) > 0) {
        ops.push_back(DropNode{key});
      } else {
        ops.push_back(PutNode{key.job, key.tile, small_node(key.range.level, 0, static_cast<float>(random(1000)))});
        nodes.insert(key);
      }
    }
    commit(*plain, ops);
    commit(*other, coalesce(ops));
    ASSERT_EQ(describe(loaded(*other)), describe(loaded(*plain))) << "round " << round;
  }
}

TEST_P(StoreConformance, ManyNodesOfSeveralJobsAreKept) {
  // More than a store reads or writes at once.
  StoredState expected;
  expected.next_job_id = 4;
  std::vector<StoreOp> ops;
  for (std::uint64_t id = 1; id <= 3; ++id) {
    ops.push_back(PutJob{full_record(id)});
    StoredState::StoredJob& job = expected.jobs.emplace_back(StoredState::StoredJob{full_record(id), {}});
    for (std::uint32_t i = 0; i < 150; ++i) {
      const TileId tile{i / 3};
      const auto node = small_node(i % 3, i, static_cast<float>(id));
      ops.push_back(PutNode{JobId{id}, tile, node});
      job.nodes.push_back({tile, node});
    }
  }
  {
    const auto store = open();
    loaded(*store);
    commit(*store, ops);
  }
  EXPECT_EQ(describe(loaded(*open())), describe(expected));
}

}  // namespace lightmill::test
