#include "server/store/sqlite/sqlite_store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "server/store/data_directory.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/store_conformance.h"

namespace lightmill {
namespace {

using test::StoreConformance;
using test::TemporaryFolder;

void execute(const std::filesystem::path& file, const std::string& sql) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(handle);
  sqlite3_close(handle);
}

class SqlitePlace final : public test::StorePlace {
 public:
  std::unique_ptr<Store> open() override {
    Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    EXPECT_TRUE(store.ok()) << store.status();
    return std::move(store).value();
  }
  void damage_tile(std::uint32_t tile) override {
    execute(file_, fmt::format("UPDATE nodes SET samples = zeroblob(length(samples)) WHERE tile = {}", tile));
  }
  void update(const std::string& table, const std::string& change) override {
    execute(file_, fmt::format("UPDATE {} SET {}", table, change));
  }

 private:
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "store.sqlite";
};

INSTANTIATE_TEST_SUITE_P(Sqlite, StoreConformance,
                         ::testing::Values(test::StoreKind{"sqlite", [] { return std::make_unique<SqlitePlace>(); }}),
                         [](const auto& info) { return info.param.name; });

class SqliteStoreTest : public ::testing::Test {
 protected:
  std::unique_ptr<Store> open() {
    Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    EXPECT_TRUE(store.ok()) << store.status();
    return std::move(store).value();
  }
  /// Makes the file one of an earlier format.
  void go_back_to(int format) {
    sql("ALTER TABLE jobs DROP COLUMN checksum; ALTER TABLE results DROP COLUMN checksum");
    if (format < 11) {
      sql("ALTER TABLE jobs DROP COLUMN allow_mixed; ALTER TABLE results DROP COLUMN fingerprint_class");
    }
    if (format < 10) {
      sql("ALTER TABLE jobs DROP COLUMN verify_share; ALTER TABLE jobs DROP COLUMN results_verified;"
          "ALTER TABLE jobs DROP COLUMN nodes_dropped; ALTER TABLE results DROP COLUMN machine;"
          "ALTER TABLE results DROP COLUMN verification; DROP TABLE quarantine; DROP TABLE verification_secret");
    }
    if (format < 9) {
      sql("DROP TABLE actions");
    }
    if (format < 8) {
      sql("DROP TABLE tokens");
    }
    if (format < 7) {
      sql("ALTER TABLE jobs DROP COLUMN goal_adaptive; ALTER TABLE job_settings DROP COLUMN allocation");
    }
    if (format < 6) {
      sql("ALTER TABLE job_settings DROP COLUMN method_candidates");
    }
    if (format < 5) {
      sql("DROP TABLE job_errors");
    }
    if (format < 4) {
      sql("ALTER TABLE job_settings DROP COLUMN method_chosen; ALTER TABLE job_settings DROP COLUMN method_reasons;"
          "ALTER TABLE job_settings DROP COLUMN method_notices");
    }
    if (format < 3) {
      sql("ALTER TABLE jobs DROP COLUMN goal_error; ALTER TABLE jobs DROP COLUMN reached");
    }
    if (format < 2) {
      sql("ALTER TABLE job_settings DROP COLUMN meters");
    }
    sql(fmt::format("PRAGMA user_version = {}", format));
  }
  void sql(const std::string& text) { execute(file_, text); }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "store.sqlite";
};

/// A job with some 50 MB of nodes, which is deleted.
void fill_and_delete(Store& store) {
  ASSERT_TRUE(store.load().ok());
  std::vector<StoreOp> ops{PutJob{test::full_record(1)}};
  for (std::uint32_t tile = 0; tile < 500; ++tile) {
    auto node = std::make_shared<Node>();
    node->values.assign(25'000, static_cast<float>(tile));
    ops.push_back(PutNode{JobId{1}, TileId{tile}, std::move(node)});
  }
  ASSERT_TRUE(store.commit(ops).ok());
  ASSERT_TRUE(store.commit(std::vector<StoreOp>{DeleteJobRows{JobId{1}}}).ok());
}

TEST_F(SqliteStoreTest, WhatIsDeletedIsGivenBackInPieces) {
  const auto store = open();
  fill_and_delete(*store);
  EXPECT_TRUE(store->tidy()) << "8 MiB, and there is more";
  const auto once = std::filesystem::file_size(file_);
  int more = 0;
  for (; store->tidy(); ++more) {
    ASSERT_LT(more, 10);
  }
  EXPECT_LT(std::filesystem::file_size(file_), once);
  EXPECT_LT(std::filesystem::file_size(file_), 18u << 20);
  EXPECT_FALSE(store->tidy());
}

TEST_F(SqliteStoreTest, AFileOfAnEarlierFormatKeepsItsPagesAndItsJournal) {
  open();
  sql("PRAGMA journal_mode = DELETE; PRAGMA auto_vacuum = NONE; VACUUM; PRAGMA journal_mode = WAL");
  const auto store = open();
  fill_and_delete(*store);
  const auto before = std::filesystem::file_size(file_.string() + "-wal");
  EXPECT_GT(before, 0u);
  EXPECT_FALSE(store->tidy());
  EXPECT_EQ(std::filesystem::file_size(file_.string() + "-wal"), before) << "nothing is written for nothing";
}

TEST_F(SqliteStoreTest, ANewerFormatIsRefusedWithWhatToDo) {
  open();
  sql("PRAGMA user_version = 99");
  const auto store = open_sqlite_store(file_);
  EXPECT_EQ(store.status().code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(store.status()).find("newer"), std::string::npos) << store.status();
  EXPECT_NE(message_of(store.status()).find(file_.string()), std::string::npos) << store.status();
}

TEST_F(SqliteStoreTest, AFileOfFormat1IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(1);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(state->jobs.at(0).record.spec.settings.meters, 0u);
  EXPECT_EQ(state->jobs[0].record.spec.settings.scene, test::full_record(1).spec.settings.scene);
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(2)}}).ok());
  EXPECT_EQ(open()->load()->jobs.at(1).record.spec.settings.meters, 5u);
}

TEST_F(SqliteStoreTest, JobsOfFormat11GetTheirChecksums) {
  const PutResult result{{JobId{1}, TileId{0}, {0, 0}}, Hash128{1, 2}, {"worker", "machine"}, true};
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}, result}).ok());
  go_back_to(11);
  {
    const Result<StoredState> state = open()->load();
    ASSERT_TRUE(state.ok()) << state.status();
    EXPECT_EQ(state->jobs.at(0).results.size(), 1u);
  }
  sql("UPDATE job_settings SET seed = seed + 1");
  EXPECT_EQ(open()->load()->damaged_jobs, std::vector{JobId{1}});
}

TEST_F(SqliteStoreTest, AFileOfFormat2IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(2);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(state->jobs.at(0).record.spec.goal, (Goal{300, 12.5, 0}));
  EXPECT_EQ(state->jobs[0].record.reached, GoalLimit::none);
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(2)}}).ok());
  EXPECT_EQ(open()->load()->jobs.at(1).record.spec.goal, test::full_record(2).spec.goal);
}

TEST_F(SqliteStoreTest, AFileOfFormat3IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(3);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(state->jobs.at(0).record.method_notes, MethodNotes{});
  EXPECT_EQ(state->jobs[0].record.spec.goal, (Goal{300, 12.5, test::full_record(1).spec.goal.error}));
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(2)}}).ok());
  EXPECT_EQ(open()->load()->jobs.at(1).record.method_notes, test::full_record(2).method_notes);
}

TEST_F(SqliteStoreTest, AFileOfFormat6IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(6);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_TRUE(state->jobs.at(0).record.allocation.even());
  EXPECT_FALSE(state->jobs[0].record.spec.goal.adaptive);
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(2)}}).ok());
  EXPECT_EQ(open()->load()->jobs.at(1).record.allocation, test::full_record(2).allocation);
}

TEST_F(SqliteStoreTest, AFileOfFormat7IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(7);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_TRUE(state->tokens.empty());
  EXPECT_EQ(state->jobs.at(0).record.allocation, test::full_record(1).allocation);
  const TokenRecord token{"00112233aabb", "ada", {Role::submit}, sha256("one"), "root", 1, 2};
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutToken{token}}).ok());
  EXPECT_EQ(open()->load()->tokens, std::vector{token});
}

TEST_F(SqliteStoreTest, AFileOfFormat8IsBroughtUpToDate) {
  const TokenRecord token{"00112233aabb", "ada", {Role::submit}, sha256("one"), "root", 1, 2};
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutToken{token}}).ok());
  go_back_to(8);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_TRUE(state->actions.empty());
  EXPECT_EQ(state->tokens, std::vector{token});
  const Action action{1, 2, "ada", Proof::none, "", "", "CancelJob", 3, "", StatusCode::kOk, ""};
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutAction{action}}).ok());
  EXPECT_EQ(open()->load()->actions, std::vector{action});
}

TEST_F(SqliteStoreTest, AFileOfFormat9IsBroughtUpToDate) {
  const NodeKey key{JobId{1}, TileId{0}, {0, 0}};
  const PutResult result{key, Hash128{1, 2}, {"worker", "machine"}, true};
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}, result}).ok());
  go_back_to(9);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  const StoredState::StoredJob& job = state->jobs.at(0);
  EXPECT_EQ(job.record.spec.verify_share, kVerifyShare);
  EXPECT_EQ(job.record.counters.results_verified, 0u);
  ASSERT_EQ(job.results.size(), 1u);
  EXPECT_EQ(state->renderers.at(job.results[0].by), (Renderer{"worker", ""}));
  EXPECT_FALSE(job.results[0].to_verify);
  EXPECT_NE(state->secret, Sha256{});
}

TEST_F(SqliteStoreTest, AFileOfFormat10IsBroughtUpToDate) {
  const NodeKey key{JobId{1}, TileId{0}, {0, 0}};
  const PutResult result{key, Hash128{1, 2}, {"worker", "machine", "class"}, true};
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}, result}).ok());
  go_back_to(10);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_FALSE(state->jobs.at(0).record.spec.allow_mixed);
  EXPECT_EQ(state->jobs[0].record.spec.verify_share, test::full_record(1).spec.verify_share);
  ASSERT_EQ(state->jobs[0].results.size(), 1u);
  EXPECT_EQ(state->renderers.at(state->jobs[0].results[0].by), (Renderer{"worker", "machine"}));
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(2)}, result}).ok());
  const Result<StoredState> after = open()->load();
  EXPECT_TRUE(after->jobs.at(1).record.spec.allow_mixed);
  EXPECT_EQ(after->renderers.at(after->jobs.at(0).results.at(0).by), result.by);
}

TEST_F(SqliteStoreTest, EachHasItsSecretAndKeepsIt) {
  const Sha256 secret = open()->load()->secret;
  EXPECT_EQ(open()->load()->secret, secret);
  std::filesystem::remove(file_);
  EXPECT_NE(open()->load()->secret, secret);
}

TEST_F(SqliteStoreTest, AnAllocationOfOtherTilesIsNotLoaded) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(7)}}).ok());
  for (const char* const bytes : {"x'0001'", "x'000001000003'"}) {
    sql(fmt::format("UPDATE job_settings SET allocation = {}; UPDATE jobs SET checksum = x''", bytes));
    EXPECT_EQ(open()->load()->damaged_jobs, std::vector{JobId{7}}) << bytes;
  }
}

TEST_F(SqliteStoreTest, AFileOfFormat4IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(4);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_TRUE(state->jobs.at(0).record.history.empty());
  EXPECT_EQ(state->jobs[0].record.method_notes, test::full_record(1).method_notes);
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(2)}}).ok());
  EXPECT_EQ(open()->load()->jobs.at(1).record.history, test::full_record(2).history);
}

TEST_F(SqliteStoreTest, AFileOfFormat5IsBroughtUpToDate) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  go_back_to(5);
  const Result<StoredState> state = open()->load();
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(state->jobs.at(0).record.history, test::full_record(1).history);
  EXPECT_EQ(state->jobs.at(0).record.method_notes, test::full_record(1).method_notes);
  JobRecord undecided = test::full_record(2);
  undecided.method_notes.candidates = {"path", "whitted"};
  EXPECT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{undecided}}).ok());
  EXPECT_EQ(open()->load()->jobs.at(1).record.method_notes, undecided.method_notes);
}

TEST_F(SqliteStoreTest, AFileThatIsNoStoreIsRefused) {
  sql("CREATE TABLE other (x)");
  EXPECT_EQ(open_sqlite_store(file_).status().code(), StatusCode::kFailedPrecondition) << "not to be overwritten";
}

TEST(DataDirectory, HasOneUserAtATime) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "deep" / "data";
  {
    const auto first = DataDirectory::open(path);
    ASSERT_TRUE(first.ok()) << first.status();
    const auto second = DataDirectory::open(path);
    EXPECT_EQ(second.status().code(), StatusCode::kFailedPrecondition);
    EXPECT_NE(message_of(second.status()).find(path.string()), std::string::npos);
    EXPECT_NE(message_of(second.status()).find("--data"), std::string::npos);
    EXPECT_NE(message_of(second.status()).find(std::to_string(::getpid())), std::string::npos);
  }
  EXPECT_TRUE(DataDirectory::open(path).ok()) << "the lock falls with its owner";
}

}  // namespace
}  // namespace lightmill
