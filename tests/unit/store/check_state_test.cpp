#include "server/store/check_state.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/film/film.h"
#include "server/store/asset_folder.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/sqlite_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/stored_examples.h"

namespace lightmill::test {
namespace {

/// A job of two tiles.
JobRecord record(std::uint64_t id) {
  JobRecord record = full_record(id);
  RenderSettings& settings = record.spec.settings;
  settings.width = 70;
  settings.height = 64;
  settings.crop = {0, 0, 70, 64};
  settings.layers = {LayerSpec{}};
  settings.meters = 0;
  settings.method = "path";
  record.allocation = {};
  return record;
}

PutNode node(std::uint64_t job, std::uint32_t tile) {
  const RenderSettings settings = record(job).spec.settings;
  const Film film(grid_of(settings), NodeLayout(settings.layers));
  auto made = std::make_shared<Node>();
  made->values.assign(film.expected_values(TileId{tile}, made->range), 0.5f);
  return {JobId{job}, TileId{tile}, std::move(made)};
}

/// Two jobs, each of two nodes; the assets "one" and "two" belong to both.
class CheckStateTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto store = open_store();
    ASSERT_TRUE(store->load().ok());
    std::vector<StoreOp> ops;
    for (std::uint64_t id = 1; id <= 2; ++id) {
      ops.push_back(PutJob{record(id)});
      for (const std::uint32_t tile : {0u, 1u}) {
        ops.push_back(node(id, tile));
        ops.push_back(PutResult{{JobId{id}, TileId{tile}, {0, 0}}, Hash128{1, 2}, {"worker", "machine"}});
      }
    }
    ASSERT_TRUE(store->commit(ops).ok());
    const auto assets = open_assets();
    for (const char* const bytes : {"one", "two", "three"}) {
      auto upload = assets->start_upload(sha256(bytes)).value();
      ASSERT_TRUE(upload->append(as_byte_view(bytes)).ok());
      ASSERT_TRUE(upload->finish().ok());
    }
  }
  std::unique_ptr<Store> open_store() const { return open_sqlite_store(file_).value(); }
  std::unique_ptr<AssetStore> open_assets() const { return open_asset_folder(folder_.path() / "assets", {}).value(); }
  Result<StateCheck> check() const { return check_state(*open_store(), *open_assets()); }
  void damage(const std::string& which) const {
    execute("UPDATE nodes SET samples = zeroblob(length(samples)) WHERE " + which);
  }
  void execute(const std::string& sql) const { SqliteFile(file_).execute(sql); }
  std::filesystem::path asset_file(std::string_view bytes) const {
    const std::string hex = sha256(bytes).hex();
    return folder_.path() / "assets" / hex.substr(0, 2) / hex.substr(2);
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "store.sqlite";
};

TEST_F(CheckStateTest, ASoundStoreIsReportedAsSound) {
  const StateCheck found = check().value();
  EXPECT_TRUE(found.sound && found.whole);
  ASSERT_EQ(found.report.size(), 1u);
  EXPECT_TRUE(found.report[0].starts_with("2 jobs with 4 nodes")) << found.report[0];
  EXPECT_EQ(conclusion_of(found), "all is sound");
}

TEST_F(CheckStateTest, DamagedNodesAreTakenOutAndNamed) {
  damage("job = 2 AND tile = 1");
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound);
  EXPECT_TRUE(found.whole) << "it is rendered again";
  ASSERT_EQ(found.report.size(), 2u);
  EXPECT_EQ(found.report[1],
            "job 2: 1 of its nodes was damaged and removed: their samples are rendered again when a coordinator "
            "starts");
  EXPECT_TRUE(check()->sound) << "once repaired";
}

TEST_F(CheckStateTest, AFileWithoutATableIsDamaged) {
  execute("DROP TABLE nodes");
  EXPECT_EQ(open_sqlite_store(file_).status().code(), StatusCode::kDataLoss);
}

TEST_F(CheckStateTest, AnUnreadableLogEntryIsTakenOutAndNamed) {
  Action action;
  action.number = 7;
  ASSERT_TRUE(open_store()->commit(std::vector<StoreOp>{PutAction{action}}).ok());
  execute("UPDATE actions SET message = x'ff'");
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound || found.whole);
  ASSERT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("entry 7 of the log is removed: ")) << found.report[1];
  EXPECT_TRUE(check()->sound) << "once repaired";
}

TEST_F(CheckStateTest, AnAlteredJobIsTakenOutAndLost) {
  execute("UPDATE job_specs SET message = substr(message, 2) WHERE job = 2");
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound || found.whole);
  ASSERT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[0].starts_with("1 job with 2 nodes")) << found.report[0];
  EXPECT_TRUE(found.report[1].starts_with("job 2: ")) << found.report[1];
  EXPECT_TRUE(check()->sound) << "once it is gone";
}

TEST_F(CheckStateTest, ImpossibleNodesAreRenderedAgain) {
  PutNode impossible = node(1, 0);
  impossible.tile = TileId{77};
  ASSERT_TRUE(open_store()->commit(std::vector<StoreOp>{DropNode{{JobId{1}, TileId{0}, {0, 0}}}, impossible}).ok());
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound);
  EXPECT_TRUE(found.whole);
  EXPECT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 1: 2 of its nodes were damaged")) << "and that of tile 0 is gone";
  EXPECT_TRUE(check()->sound) << "once repaired";
}

TEST_F(CheckStateTest, OverlappingNodesAreRenderedAgain) {
  {
    const auto store = open_store();
    ASSERT_TRUE(store->load().ok());
    PutNode joined = node(1, 0);
    auto wide = std::make_shared<Node>(*joined.node);
    wide->range = {1, 0};
    joined.node = std::move(wide);
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{joined}).ok());
  }
  const StateCheck found = check().value();
  EXPECT_TRUE(!found.sound && found.whole);
  EXPECT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 1: 2 of its nodes were damaged")) << found.report[1];
  EXPECT_TRUE(found.report[0].starts_with("2 jobs with 3 nodes")) << found.report[0];
}

TEST_F(CheckStateTest, NodesOfUnknownOriginAreRenderedAgain) {
  ASSERT_TRUE(open_store()->commit(std::vector<StoreOp>{DropResults{{JobId{2}, TileId{1}, {0, 0}}}}).ok());
  const StateCheck found = check().value();
  EXPECT_TRUE(!found.sound && found.whole);
  EXPECT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 2: 1 of its nodes was damaged")) << found.report[1];
  EXPECT_TRUE(check()->sound) << "once repaired";
}

TEST_F(CheckStateTest, AJobThatHasLostAllRowsOfItsFilmIsNamed) {
  execute("DELETE FROM nodes WHERE job = 2; DELETE FROM results WHERE job = 2");
  const StateCheck found = check().value();
  EXPECT_TRUE(!found.sound && found.whole);
  ASSERT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 2: 1 of its nodes was damaged")) << found.report[1];
  EXPECT_TRUE(check()->sound) << "once repaired";
}

TEST_F(CheckStateTest, ADamagedRecordRemovesItsNode) {
  execute("UPDATE results SET worker = 'innocent' WHERE job = 2 AND tile = 1");
  const StateCheck found = check().value();
  EXPECT_TRUE(!found.sound && found.whole);
  EXPECT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 2: 1 of its nodes was damaged")) << found.report[1];
  EXPECT_TRUE(check()->sound) << "once repaired";
}

TEST_F(CheckStateTest, ANodeIsSoundIfEachOfItsSamplesHasOneRecord) {
  const NodeKey key{JobId{1}, TileId{0}, {3, 0}};
  const auto sound_with = [&](const std::vector<SampleRange>& recorded) {
    PutNode wide = node(1, 0);
    auto joined = std::make_shared<Node>(*wide.node);
    joined->range = key.range;
    wide.node = std::move(joined);
    std::vector<StoreOp> ops{DropNode{{JobId{1}, TileId{0}, {0, 0}}}, DropResults{key}, wide};
    for (const SampleRange& range : recorded) {
      ops.push_back(PutResult{{JobId{1}, TileId{0}, range}, Hash128{1, 2}, {"worker", "machine"}});
    }
    EXPECT_TRUE(open_store()->commit(ops).ok());
    return check()->sound;
  };
  EXPECT_TRUE(sound_with({{3, 0}}));
  EXPECT_TRUE(sound_with({{2, 0}, {1, 3}, {1, 2}}));
  EXPECT_FALSE(sound_with({{2, 0}, {1, 3}})) << "samples 4 and 5 have no record";
  EXPECT_FALSE(sound_with({{2, 0}, {1, 3}, {1, 0}})) << "a second record of other samples does not replace it";
  EXPECT_FALSE(sound_with({{3, 0}, {0, 0}})) << "the record of sample 0 was not dropped";
}

TEST_F(CheckStateTest, ADoneJobWithoutAReachedLimitIsTakenOut) {
  {
    const auto store = open_store();
    ASSERT_TRUE(store->load().ok());
    JobRecord done = record(3);
    done.state = JobState::done;
    done.reached = GoalLimit::none;
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{done}}).ok());
  }
  const StateCheck found = check().value();
  EXPECT_FALSE(found.whole);
  ASSERT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 3: ")) << found.report[1];
  EXPECT_TRUE(check()->sound);
}

TEST_F(CheckStateTest, AJobWithInvalidTimesIsTakenOut) {
  {
    const auto store = open_store();
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutProgress{JobId{2}, -5, 1, {}}}).ok());
  }
  const StateCheck found = check().value();
  EXPECT_FALSE(found.whole);
  EXPECT_EQ(found.report.size(), 2u);
  EXPECT_TRUE(found.report[1].starts_with("job 2: ")) << found.report[1];
  EXPECT_TRUE(check()->sound);
}

TEST_F(CheckStateTest, NodesLostByACancelledJobStayLost) {
  {
    const auto store = open_store();
    ASSERT_TRUE(store->load().ok());
    JobRecord cancelled = record(3);
    cancelled.state = JobState::cancelled;
    const std::vector<StoreOp> ops{PutJob{cancelled}, node(3, 0),
                                   PutResult{{JobId{3}, TileId{0}, {0, 0}}, Hash128{1, 2}, {"worker", "machine"}}};
    ASSERT_TRUE(store->commit(ops).ok());
  }
  damage("job = 3");
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound || found.whole);
  EXPECT_TRUE(found.report.back().ends_with("its picture lacks them")) << found.report.back();
}

/// An asset store that is unavailable.
class AwayAssets final : public AssetStore {
 public:
  std::vector<Sha256> digests() const override { return {sha256("one")}; }
  Result<std::uint64_t> size(const Sha256&) const override { return std::uint64_t{3}; }
  Status check_room(const Sha256&, const std::string&, std::uint64_t) const override { return unavailable("away"); }
  Result<std::unique_ptr<Upload>> start_upload(const Sha256&, const std::string&) override {
    return unavailable("away");
  }
  Status attribute(const Sha256&, const std::string&, UserLimit) override { return ok_status(); }
  Result<std::unique_ptr<Reader>> open_asset(const Sha256&) const override { return unavailable("away"); }
  std::uint64_t collect(const std::set<Sha256>&, std::int64_t) override { return collected = 1; }
  void forget(const Reader&) override { ++collected; }
  std::uint64_t total_bytes() const override { return 3; }
  std::uint64_t collected = 0;
};

TEST_F(CheckStateTest, UnavailableAssetsAreNotDamaged) {
  AwayAssets away;
  EXPECT_EQ(check_assets(away).status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(away.collected, 0u);
}

TEST_F(CheckStateTest, DamagedAndMissingAssetsAreFoundAndForgotten) {
  std::ofstream(asset_file("two")) << "tWo";
  std::ofstream(asset_file("three"), std::ios::app) << "!";
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound || found.whole);
  ASSERT_EQ(found.report.size(), 1u + 2 + 1) << "two assets, and two jobs that need one of them";
  EXPECT_EQ(found.report.back(), "asset " + sha256("two").hex() +
                                     " is missing. It blocks the samples that jobs 1, 2 have not rendered yet. "
                                     "Submit a job with the same file");
  EXPECT_TRUE(open_assets()->has(sha256("one")));
  EXPECT_FALSE(open_assets()->has(sha256("two")) || open_assets()->has(sha256("three")));
  const StateCheck again = check().value();
  EXPECT_TRUE(again.sound) << "nothing is damaged any more";
  EXPECT_FALSE(again.whole) << "and still an asset is missing";
  EXPECT_EQ(conclusion_of(again), "") << "the error says it";
}

TEST_F(CheckStateTest, AMissingAssetOfADoneJobBlocksNothing) {
  {
    const auto store = open_store();
    std::vector<StoreOp> ends;
    const StoredState state = store->load().value();
    for (const StoredState::StoredJob& stored : state.jobs) {
      JobRecord ended = stored.record;
      ended.state = JobState::done;
      ended.reached = GoalLimit::samples;
      ends.push_back(PutJob{std::move(ended)});
    }
    ASSERT_TRUE(store->commit(ends).ok());
  }
  std::ofstream(asset_file("two")) << "tWo";
  const StateCheck found = check().value();
  EXPECT_FALSE(found.sound);
  EXPECT_TRUE(found.whole);
  EXPECT_EQ(found.report.back(),
            "asset " + sha256("two").hex() +
                " is missing. No running job needs it: jobs 1, 2 have ended, and need it only for `lightmill extend`");
  EXPECT_EQ(conclusion_of(found), "damaged data is rendered or sent again. 1 asset is missing");
  EXPECT_EQ(conclusion_of(check().value()), "nothing is lost that a running job needs. 1 asset is missing");
  damage("job = 2 AND tile = 1");
  const StateCheck incomplete = check().value();
  EXPECT_FALSE(incomplete.whole);
  EXPECT_NE(incomplete.report.back().find("It blocks the samples that job 2 has not rendered yet"), std::string::npos)
      << incomplete.report.back();
}

TEST_F(CheckStateTest, SizesHaveAUnitThatFits) {
  EXPECT_TRUE(check()->report[0].ends_with("and 3 assets of 11 B have correct checksums")) << check()->report[0];
}

/// Breaks the chain of pages that hold the values of the node that was stored last.
void damage_last_page_of_values(const std::filesystem::path& path) {
  constexpr std::streamoff kPageBytes = 16384;
  constexpr std::string_view kValue("\0\0\0\x3f", 4);  // 0.5f, which follows the number of the next page
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(0, std::ios::end);
  for (std::streamoff at = file.tellg() - kPageBytes; at > 0; at -= kPageBytes) {
    std::string head(64, '\0');
    file.seekg(at).read(head.data(), 64);
    bool values = head.substr(0, 2) == std::string(2, '\0') && head.substr(2, 2) != std::string(2, '\0');
    for (std::size_t i = 0; i < 8; ++i) {
      values = values && head.substr(4 + 4 * i).find(kValue) < 4;
    }
    if (values) {
      file.seekp(at) << "\xff\xff\xff\xff";
      return;
    }
  }
  FAIL() << "no page has values and a successor";
}

TEST_F(CheckStateTest, ADamagedPageIsNamedByTableAndJob) {
  damage_last_page_of_values(file_);
  const Status status = check().status();
  EXPECT_EQ(status.code(), StatusCode::kDataLoss);
  EXPECT_NE(message_of(status).find("pages of the database are damaged, in the table nodes (job 2)"), std::string::npos)
      << status;
  EXPECT_EQ(message_of(status).find('\n'), std::string::npos) << status;
  const Status loaded = open_store()->load().status();
  EXPECT_EQ(loaded.code(), StatusCode::kDataLoss);
  EXPECT_TRUE(message_of(loaded).starts_with("table nodes, job 2: ")) << loaded;
  EXPECT_EQ(message_of(loaded).find("SELECT"), std::string::npos) << loaded;
  EXPECT_TRUE(open_store()->read_film(JobId{1}, {}).ok());
}

TEST_F(CheckStateTest, ADamagedDatabaseIsFound) {
  std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(16384);  // the second page, the head of a table
  file << std::string(200, '\x5a');
  file.close();
  const Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
  const auto assets = open_assets();
  const Status status = store.ok() ? check_state(**store, *assets).status() : store.status();
  EXPECT_EQ(status.code(), StatusCode::kDataLoss) << status;
}

}  // namespace
}  // namespace lightmill::test
