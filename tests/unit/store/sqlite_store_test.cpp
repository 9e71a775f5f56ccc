#include "server/store/sqlite/sqlite_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "common/base/file.h"
#include "server/store/commit_chain.h"
#include "server/store/data_folder.h"
#include "server/store/row_values.h"
#include "server/store/sqlite/format_12.h"
#include "tests/support/paths.h"
#include "tests/support/sqlite_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/store_conformance.h"

namespace lightmill {
namespace {

using test::SqliteFile;
using test::StoreConformance;
using test::TemporaryFolder;

class SqlitePlace final : public test::StorePlace {
 public:
  std::unique_ptr<Store> open(bool accept_loss) override {
    Result<std::unique_ptr<Store>> store = open_sqlite_store(file_, {.accept_loss = accept_loss});
    EXPECT_TRUE(store.ok()) << store.status();
    return std::move(store).value();
  }
  void damage_tile(std::uint32_t tile) override {
    SqliteFile(file_).execute(
        fmt::format("UPDATE nodes SET samples = zeroblob(length(samples)) WHERE tile = {}", tile));
  }
  void execute(const std::string& sql) override { SqliteFile(file_).execute(sql); }

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
  void sql(const std::string& text) { SqliteFile(file_).execute(text); }
  int number_in(const std::string& query) { return std::stoi(SqliteFile(file_).rows(query).at(0)); }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "store.sqlite";
  std::filesystem::path chain_ = file_.string() + "-chain";
};

/// Stores a job with about 50 MB of nodes, and deletes it.
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

TEST_F(SqliteStoreTest, DeletedSpaceIsFreedInPieces) {
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

TEST_F(SqliteStoreTest, AnotherFormatIsRefusedWithARemedy) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}}).ok());
  const auto refusal_of = [&](int format) {
    sql(fmt::format("PRAGMA user_version = {}", format));
    const Status status = open_sqlite_store(file_).status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << format;
    return message_of(status);
  };
  EXPECT_EQ(refusal_of(kSqliteFormatVersion + 1),
            file_.string() +
                " has store format 16, newer than format 15 of this lightmill-server: use the newer "
                "lightmill-server that wrote it, or choose another folder with --data");
  EXPECT_EQ(refusal_of(sqlite::kOldestFormat - 1),
            file_.string() +
                " has store format 11, older than format 15 of this lightmill-server: use the older "
                "lightmill-server that wrote it, or choose another folder with --data");
  for (const int nonsense : {0, -1}) {
    EXPECT_EQ(refusal_of(nonsense),
              fmt::format("{} has store format {}, which no lightmill-server writes: restore a backup, or "
                          "choose another folder with --data",
                          file_.string(), nonsense));
  }
  sql(fmt::format("PRAGMA user_version = {}", kSqliteFormatVersion));
  EXPECT_EQ(open()->load()->jobs.size(), 1u) << "nothing was changed";
}

TEST_F(SqliteStoreTest, AStoreOfThePreviousFormatIsConvertedAndKept) {
  const std::string before = read_file(test::source_file("tests/unit/store/format_12.sql")).value();
  sql(before);
  std::ofstream(file_.string() + ".new") << "left by a program that was killed";
  for (const std::uint64_t epoch : {3u, 4u}) {
    const StoredState state = open()->load().value();
    EXPECT_EQ(test::describe(state), test::describe(test::state_of_the_format_before()));
    EXPECT_EQ(state.epoch, epoch);
    EXPECT_EQ(state.secret.hex(), "d099ff1169dd9f1c64c049de5beb283f90307f0979e30ebc7de9db4549024986");
  }
  // The way back: the original file.
  std::filesystem::rename(file_.string() + ".format-12", file_);
  std::filesystem::remove(chain_);
  EXPECT_EQ(test::describe(open()->load().value()), test::describe(test::state_of_the_format_before()));
}

/// Formats 13 and 14: the file as the program of format 14 wrote it, and its commit chain.
class SqliteFormat14 : public SqliteStoreTest {
 protected:
  void SetUp() override {
    sql(read_file(test::source_file("tests/unit/store/format_14.sql")).value());
    CommitMark last;
    SqliteFile(file_).run(
        "SELECT id, commits, hash FROM store", [](sqlite3_stmt*) {},
        [&](sqlite3_stmt* row) {
          std::ranges::copy(test::column_bytes(row, 0), last.store.begin());
          last.commits = static_cast<std::uint64_t>(sqlite3_column_int64(row, 1));
          last.hash = stored::hash_in(test::column_bytes(row, 2)).value();
        });
    last.highest_job = 3;
    ASSERT_TRUE(CommitChain::open(chain_)->append(last).ok());
  }
  /// Turns it into a store of format 13, which had hashes of nodes without their place.
  void make_format_13() {
    for (const auto& [tile, node] :
         {std::pair{0, test::small_node(1, 0, 2.5f)}, {3, test::small_node(0, 4, -1e-30f)}}) {
      std::string hash;
      for (const std::uint8_t byte : hash_bytes(hash_of(*node))) {
        hash += fmt::format("{:02x}", byte);
      }
      sql(fmt::format("PRAGMA user_version = 13; UPDATE nodes SET hash = x'{}' WHERE tile = {}", hash, tile));
    }
  }
};

TEST_F(SqliteFormat14, IsConvertedAndKept) {
  for (const int format : {14, 13}) {
    if (format == 13) {
      make_format_13();
    }
    for (const std::uint64_t epoch : {4u, 5u}) {
      const StoredState state = test::load_with_films(*open()).value();
      EXPECT_EQ(test::describe(state), test::describe(test::state_of_the_format_before())) << format;
      EXPECT_EQ(state.epoch, epoch);
    }
    EXPECT_EQ(number_in("PRAGMA user_version"), kSqliteFormatVersion);
    // The way back: the copy.
    const std::string kept = fmt::format("{}.format-{}", file_.string(), format);
    std::filesystem::rename(kept, file_);
    std::filesystem::rename(kept + "-chain", chain_);
    EXPECT_EQ(number_in("PRAGMA user_version"), format);
  }
}

TEST_F(SqliteFormat14, IsConvertedWithItsSums) {
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{DropNode{{JobId{1}, TileId{0}, {1, 0}}}}).ok());
  EXPECT_TRUE(open()->load()->damaged.empty());
  sql("DELETE FROM results WHERE tile = 3");
  EXPECT_EQ(open()->load()->damaged,
            (std::vector<NodeKey>{{JobId{1}, TileId{3}, {0, 4}}, {JobId{1}, TileId{0}, {0, 0}}}));
}

TEST_F(SqliteFormat14, IsNotConvertedIfRowsAreLost) {
  sql("DELETE FROM tokens");
  const Status refused = open_sqlite_store(file_).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find("its table tokens has lost rows"), std::string::npos) << refused;
  EXPECT_EQ(number_in("PRAGMA user_version"), 14);
  EXPECT_TRUE(open_sqlite_store(file_, {.accept_loss = true}).value()->load()->tokens.empty());
  EXPECT_TRUE(open()->load().ok()) << "it was accepted once";
}

TEST_F(SqliteFormat14, IsNotConvertedIfItCannotBeKept) {
  const std::filesystem::path kept = file_.string() + ".format-14";
  std::filesystem::create_directories(kept / "in the way");
  const Status refused = open_sqlite_store(file_).status();
  EXPECT_EQ(message_of(refused).find(file_.string() + " cannot be kept as " + kept.string() + ": "), 0u) << refused;
  EXPECT_FALSE(std::filesystem::exists(kept.string() + ".new"));
  EXPECT_EQ(number_in("PRAGMA user_version"), 14);
  std::filesystem::remove_all(kept);
  EXPECT_EQ(open()->load()->jobs.size(), 2u);
}

TEST_F(SqliteStoreTest, ANodeInThePlaceOfAnotherIsDamaged) {
  ASSERT_TRUE(open()
                  ->commit(std::vector<StoreOp>{PutJob{test::full_record(1)}, PutJob{test::full_record(2)},
                                                PutNode{JobId{1}, TileId{0}, test::small_node(0, 0, 1)},
                                                PutNode{JobId{2}, TileId{0}, test::small_node(0, 0, 2)}})
                  .ok());
  sql("UPDATE nodes SET tile = 9 WHERE job = 1; UPDATE nodes SET job = 1 WHERE job = 2; UPDATE nodes SET job = 2, tile = 0 "
      "WHERE tile = 9");
  EXPECT_EQ(test::load_with_films(*open())->damaged.size(), 2u);
}

TEST_F(SqliteStoreTest, ConversionDoesNotHideDamage) {
  sql(read_file(test::source_file("tests/unit/store/format_12.sql")).value());
  sql("UPDATE jobs SET owner = 'mallory' WHERE id = 2; UPDATE nodes SET samples = zeroblob(96) WHERE tile = 0; "
      "UPDATE results SET worker = 'innocent' WHERE tile = 3");
  const StoredState state = open()->load().value();
  ASSERT_EQ(state.jobs.size(), 1u);
  EXPECT_EQ(state.jobs[0].nodes.size(), 1u);
  EXPECT_EQ(state.jobs[0].results.size(), 2u);
  EXPECT_EQ(state.next_job_id, 4u);
}

TEST_F(SqliteStoreTest, ALostJobLeavesTilesOfOtherJobsIntact) {
  std::vector<StoreOp> ops{PutJob{test::full_record(1)}, PutJob{test::full_record(2)}};
  for (std::uint32_t tile = 0; tile < 300; ++tile) {
    for (const JobId job : {JobId{1}, JobId{2}}) {
      ops.push_back(PutNode{job, TileId{tile}, test::small_node(0, 0, 1)});
      ops.push_back(PutResult{{job, TileId{tile}, {0, 0}}, Hash128{1, 2}, {"worker", "machine"}});
    }
  }
  ASSERT_TRUE(open()->commit(ops).ok());
  sql("DELETE FROM jobs WHERE id = 2");
  EXPECT_EQ(open()->load().status().code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(open_sqlite_store(file_, {.accept_loss = true}).value()->load()->jobs.at(0).nodes.size(), 300u);
  EXPECT_EQ(number_in("SELECT count(*) FROM nodes"), 300);
  EXPECT_EQ(number_in("SELECT count(*) FROM results"), 300);
  const StoredState state = open()->load().value();
  EXPECT_TRUE(state.damaged.empty());
  EXPECT_EQ(state.jobs.at(0).nodes.size(), 300u);
}

TEST_F(SqliteStoreTest, EachStoreKeepsItsOwnSecret) {
  const Sha256 secret = open()->load()->secret;
  EXPECT_EQ(open()->load()->secret, secret);
  std::filesystem::remove(file_);
  std::filesystem::remove(chain_);
  EXPECT_NE(open()->load()->secret, secret);
  sql("UPDATE store SET secret = zeroblob(32)");
  EXPECT_EQ(open_sqlite_store(file_).status().code(), StatusCode::kDataLoss);
}

TEST_F(SqliteStoreTest, AnAllocationOfOtherTilesIsNotLoaded) {
  JobRecord record = test::full_record(7);
  record.allocation = Allocation::of({0, 1}).value();  // of six tiles
  ASSERT_TRUE(open()->commit(std::vector<StoreOp>{PutJob{record}}).ok()) << "with the checksum of just this";
  EXPECT_EQ(open()->load()->damaged_jobs, std::vector{JobId{7}});
}

TEST_F(SqliteStoreTest, AFileThatIsNoStoreIsRefused) {
  sql("CREATE TABLE other (x)");
  EXPECT_EQ(open_sqlite_store(file_).status().code(), StatusCode::kFailedPrecondition) << "not to be overwritten";
}

// ---- lost commits ----

CommitMark mark(std::uint64_t commits, std::uint64_t hash = 0, std::uint8_t store = 1) {
  CommitMark mark;
  mark.store.fill(store);
  mark.commits = commits;
  mark.hash = {hash, commits};
  mark.highest_job = 9;
  return mark;
}

TEST(CommitChain, KeepsTheLastMarkAndSurvivesADamagedSlot) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "store.sqlite-chain";
  {
    CommitChain chain = CommitChain::open(path).value();
    EXPECT_FALSE(chain.last().has_value());
    for (std::uint64_t commits = 1; commits <= 5; ++commits) {
      ASSERT_TRUE(chain.append(mark(commits)).ok());
    }
  }
  EXPECT_EQ(CommitChain::open(path)->last(), mark(5));
  for (std::streamoff bit = 0; bit < 64 * 8; ++bit) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    const std::streamoff at = 4096 + bit / 8;  // the fifth mark's slot
    const auto flip = [&] {
      file.seekg(at);
      const int byte = file.get() ^ (1 << bit % 8);
      file.seekp(at);
      file.put(static_cast<char>(byte)).flush();
    };
    flip();
    EXPECT_EQ(CommitChain::open(path)->last(), mark(4)) << "bit " << bit;
    flip();
  }
}

TEST(CommitChain, OnlyAStoreWithAllAcknowledgedCommitsPasses) {
  EXPECT_TRUE(check_chain(mark(5), mark(5)).ok());
  EXPECT_TRUE(check_chain(mark(5), mark(6)).ok()) << "the last one was not acknowledged";
  EXPECT_TRUE(check_chain(std::nullopt, mark(0)).ok());
  EXPECT_TRUE(check_chain(std::nullopt, mark(1)).ok()) << "a new store, killed before its first record";
  for (const auto& [chain, store, why] : std::vector<std::tuple<std::optional<CommitMark>, CommitMark, std::string>>{
           {mark(5), mark(4), "its last commit is 4, but commits up to 5 were acknowledged"},
           {mark(5), mark(7), "the commit chain is older: it ends at 5"},
           {mark(5), mark(5, 1), "differ from the acknowledged ones"},
           {mark(5), mark(5, 0, 2), "belongs to another store"},
           {std::nullopt, mark(2), "is missing or damaged"}}) {
    const Status status = check_chain(chain, store);
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
    EXPECT_NE(message_of(status).find(why), std::string::npos) << message_of(status);
  }
}

TEST_F(SqliteStoreTest, NoCommitIsAcknowledgedWithoutItsRecord) {
  std::filesystem::create_symlink("/dev/full", chain_);
  const Status status = open()->load().status();
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(message_of(status).find("cannot write " + chain_.string()), std::string::npos) << status;
  std::filesystem::remove(chain_);
  EXPECT_EQ(open()->load()->epoch, 2u) << "the first was stored, and no record of it";
}

TEST_F(SqliteStoreTest, ALoadAfterOneThatFailedStillFindsLostRows) {
  ASSERT_TRUE(open()
                  ->commit(std::vector<StoreOp>{PutJob{test::full_record(1)},
                                                PutNode{JobId{1}, TileId{0}, test::small_node(0, 0, 1)},
                                                PutResult{{JobId{1}, TileId{0}, {0, 0}}, Hash128{1, 2}, {"w", "m"}}})
                  .ok());
  sql("DELETE FROM results");
  const auto store = open();
  rlimit limit{};
  ::getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit nothing{0, limit.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &nothing);
  const Status failed = store->load().status();
  ::setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(failed.ok());
  EXPECT_EQ(store->load()->damaged.size(), 1u);
}

TEST(DataFolder, HasOneUserAtATime) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "deep" / "data";
  {
    const auto first = DataFolder::open(path);
    ASSERT_TRUE(first.ok()) << first.status();
    const auto second = DataFolder::open(path);
    EXPECT_EQ(second.status().code(), StatusCode::kFailedPrecondition);
    EXPECT_NE(message_of(second.status()).find(path.string()), std::string::npos);
    EXPECT_NE(message_of(second.status()).find("--data"), std::string::npos);
    EXPECT_NE(message_of(second.status()).find(std::to_string(::getpid())), std::string::npos);
  }
  EXPECT_TRUE(DataFolder::open(path).ok()) << "the lock falls with its owner";
  std::filesystem::permissions(path, std::filesystem::perms(0777));
  EXPECT_EQ(message_of(DataFolder::open(path).status()),
            fmt::format("other users of this machine can write to the data folder {0}, and could replace the farm's "
                        "files: run `chmod o-w {0}`",
                        std::string(path)));
}

}  // namespace
}  // namespace lightmill
