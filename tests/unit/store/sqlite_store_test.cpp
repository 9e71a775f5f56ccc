#include "server/store/sqlite/sqlite_store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "server/store/data_directory.h"
#include "server/store/row_values.h"
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

TEST_F(SqliteStoreTest, AFileThatCannotShrinkIsLeftAlone) {
  open();
  sql("PRAGMA journal_mode = DELETE; PRAGMA auto_vacuum = NONE; VACUUM; PRAGMA journal_mode = WAL");
  const auto store = open();
  fill_and_delete(*store);
  const auto before = std::filesystem::file_size(file_.string() + "-wal");
  EXPECT_GT(before, 0u);
  EXPECT_FALSE(store->tidy());
  EXPECT_EQ(std::filesystem::file_size(file_.string() + "-wal"), before) << "nothing is written for nothing";
}

TEST_F(SqliteStoreTest, AnotherFormatIsRefusedWithWhatToDo) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  const auto refusal_of = [&](int format) {
    sql(fmt::format("PRAGMA user_version = {}", format));
    const Status status = open_sqlite_store(file_).status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << format;
    return message_of(status);
  };
  EXPECT_EQ(refusal_of(kSqliteFormatVersion + 1),
            file_.string() +
                " has store format 13, newer than format 12 of this lightmill-server: use the newer "
                "lightmill-server that wrote it, or choose another directory with --data");
  EXPECT_EQ(refusal_of(kSqliteFormatVersion - 1),
            file_.string() +
                " has store format 11, older than format 12 of this lightmill-server: use the older "
                "lightmill-server that wrote it, or choose another directory with --data");
  for (const int nonsense : {0, -1}) {
    EXPECT_EQ(refusal_of(nonsense),
              fmt::format("{} has store format {}, which no lightmill-server writes: put a backup in its place, or "
                          "choose another directory with --data",
                          file_.string(), nonsense));
  }
  sql(fmt::format("PRAGMA user_version = {}", kSqliteFormatVersion));
  EXPECT_EQ(open()->load()->jobs.size(), 1u) << "nothing was changed";
}

TEST_F(SqliteStoreTest, EachHasItsSecretAndKeepsIt) {
  const Sha256 secret = open()->load()->secret;
  EXPECT_EQ(open()->load()->secret, secret);
  std::filesystem::remove(file_);
  EXPECT_NE(open()->load()->secret, secret);
}

TEST_F(SqliteStoreTest, AnAllocationOfOtherTilesIsNotLoaded) {
  JobRecord record = test::full_record(7);
  record.allocation = Allocation::of({0, 1}).value();  // of six tiles
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{record}}).ok()) << "with the checksum of just this";
  EXPECT_EQ(open()->load()->damaged_jobs, std::vector{JobId{7}});
  record = test::full_record(7);
  EXPECT_TRUE(stored::allocation_in(std::string_view("\0\0\1\0\0\2", 6), record).ok());
  EXPECT_EQ(stored::allocation_in(std::string_view("\0\0\1\0\0\3", 6), record).status().code(), StatusCode::kDataLoss)
      << "a share that is none";
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
