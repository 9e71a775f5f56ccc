// The PostgreSQL store on a real server: the tests of every store, and its own.
#include "server/store/postgres/postgres_store.h"

#include <gtest/gtest.h>

#include "common/base/file.h"
#include "server/store/commit_chain.h"
#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/migrations.h"
#include "server/store/postgres/schema.h"
#include "server/store/row_values.h"
#include "tests/integration/store/postgres_fixture.h"
#include "tests/support/paths.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/asset_conformance.h"
#include "tests/unit/store/store_conformance.h"

namespace lightmill::test {
namespace {

std::string damaging(std::uint32_t tile) {
  return fmt::format(
      "UPDATE lightmill.nodes SET samples = decode(repeat('00', length(samples)), 'hex') WHERE tile = {}", tile);
}

class PostgresPlace final : public StorePlace {
 public:
  std::unique_ptr<Store> open(bool accept_loss) override {
    PostgresOptions options = options_for(url_);
    options.accept_loss = accept_loss;
    return opened(options).store;
  }
  void damage_tile(std::uint32_t tile) override { run_sql(url_, damaging(tile)); }
  void execute(const std::string& sql) override { run_sql(url_, "SET search_path = lightmill; " + sql); }

 private:
  std::string url_ = server().new_database();
};

class PostgresAssetPlace final : public AssetPlace {
 public:
  std::unique_ptr<AssetStore> open(AssetLimits limits) override {
    PostgresOptions options = options_for(url_);
    options.assets = limits;
    return opened(options).assets;
  }
  void leave_half_an_upload() override {
    run_sql(url_,
            "WITH half AS (INSERT INTO lightmill.assets (size_bytes, stored) VALUES (0, now()) RETURNING id) "
            "INSERT INTO lightmill.asset_pieces SELECT id, 0, 'rubbish' FROM half");
  }
  void age(std::chrono::seconds by) override {
    run_sql(url_, fmt::format("UPDATE lightmill.assets SET stored = stored - make_interval(secs => {})", by.count()));
  }
  bool has_halves() override {
    return run_sql(url_, "SELECT count(*) FROM lightmill.assets WHERE digest IS NULL") != "0";
  }

 private:
  std::string url_ = server().new_database();
};

const auto kNamed = [](const auto& info) { return info.param.name; };
INSTANTIATE_TEST_SUITE_P(Postgres, StoreConformance,
                         ::testing::Values(StoreKind{"postgres", [] { return std::make_unique<PostgresPlace>(); }}),
                         kNamed);
INSTANTIATE_TEST_SUITE_P(Postgres, AssetConformance,
                         ::testing::Values(AssetKind{"postgres",
                                                     [] { return std::make_unique<PostgresAssetPlace>(); }}),
                         kNamed);

TEST_F(PostgresStoreTest, AnotherFormatIsRefusedWithARemedy) {
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  }
  const std::string place = postgres::Target{url_, ""}.describe().value();
  const auto refusal_after = [&](const std::string& change) {
    sql(change);
    const Status status = open_postgres(options()).status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << change;
    return message_of(status);
  };
  EXPECT_EQ(refusal_after(fmt::format("UPDATE lightmill.meta SET format = {}", postgres::kFormat + 1)),
            place +
                " has store format 11, newer than format 10 of this lightmill-server: use the newer lightmill-server "
                "that wrote it, or choose another database with --store");
  EXPECT_EQ(refusal_after(fmt::format("UPDATE lightmill.meta SET format = {}", postgres::kOldestFormat - 1)),
            place +
                " has store format 5, older than format 10 of this lightmill-server: use the older lightmill-server "
                "that wrote it, or choose another database with --store");
  EXPECT_EQ(refusal_after("DELETE FROM lightmill.meta"),
            place +
                " has store format 0, which no lightmill-server writes: restore a backup, or choose another "
                "database with --store");
  sql(fmt::format("INSERT INTO lightmill.meta VALUES ({})", postgres::kFormat));
  EXPECT_EQ(stored().jobs.size(), 1u) << "nothing was changed";
}

TEST_F(PostgresStoreTest, ADatabaseOfThePreviousFormatIsMigratedAndKept) {
  const std::string before = read_file(source_file("tests/integration/store/format_6.sql")).value();
  sql(before);
  sql("UPDATE lightmill.lease SET expires = clock_timestamp() + interval '1 hour'");
  const Status busy = open_postgres(options()).status();
  EXPECT_EQ(busy.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(busy).find("a coordinator of the previous version uses it"), std::string::npos) << busy;
  sql("UPDATE lightmill.lease SET expires = '-infinity'");
  for (const std::uint64_t epoch : {2u, 3u}) {
    const PostgresStores stores = opened(options());
    const StoredState state = stores.store->load().value();
    EXPECT_EQ(describe(state), describe(state_of_the_format_before()));
    EXPECT_EQ(state.epoch, epoch);
    EXPECT_TRUE(stores.assets->has(sha256("an asset")));
    const std::string more = fmt::format("uploaded in epoch {}", epoch);
    auto upload = stores.assets->start_upload(sha256(more)).value();
    EXPECT_TRUE(upload->append(as_byte_view(more)).ok() && upload->finish().ok());
  }
  // The way back: the old tables under their old name.
  sql("DROP SCHEMA lightmill CASCADE; ALTER SCHEMA lightmill_format_6 RENAME TO lightmill");
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), "6");
  EXPECT_EQ(describe(stored()), describe(state_of_the_format_before()));
}

/// "'\\x…'"
std::string literal_of(const Hash128& hash) {
  std::string text;
  for (const std::uint8_t byte : hash_bytes(hash)) {
    text += fmt::format("{:02x}", byte);
  }
  return "'\\x" + text + "'";
}

TEST_F(PostgresStoreTest, ADatabaseOfFormat7IsMigratedAndKept) {
  const std::shared_ptr<const Node> node = small_node(0, 0, 1);
  std::string before;
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store
                    ->commit(std::vector<StoreOp>{PutJob{full_record(1)}, PutNode{JobId{1}, TileId{0}, node},
                                                  PutToken{{"t", "ada", Roles::all(), {}, "root", 1, 2}}})
                    .ok());
    before = describe(load_with_films(*store).value());
  }
  // As format 7 has it: another name for the epoch, no summary, and hashes of nodes without their place.
  sql(fmt::format(
      "SET search_path = lightmill; ALTER TABLE current_epoch RENAME TO turn; DROP TABLE summary; UPDATE meta SET "
      "format = {}; UPDATE nodes SET hash = {}",
      postgres::kSameRowsFormat, literal_of(hash_of(*node))));
  sql("UPDATE lightmill.lease SET expires = clock_timestamp() + interval '1 hour'");
  EXPECT_EQ(open_postgres(options()).status().code(), StatusCode::kFailedPrecondition) << "a coordinator uses it";
  sql("UPDATE lightmill.lease SET expires = '-infinity'");
  for (int start = 0; start < 2; ++start) {
    EXPECT_EQ(describe(load_with_films(*opened(options()).store).value()), before);
    EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), std::to_string(postgres::kFormat));
  }
  // The way back: the old tables under their old name.
  sql("DROP SCHEMA lightmill CASCADE; ALTER SCHEMA lightmill_format_7 RENAME TO lightmill");
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), std::to_string(postgres::kSameRowsFormat));
  EXPECT_EQ(describe(load_with_films(*opened(options()).store).value()), before);
}

TEST_F(PostgresStoreTest, ADatabaseOfFormat8IsMigratedAndKept) {
  sql(read_file(source_file("tests/integration/store/format_8.sql")).value());
  sql("CREATE TABLE kept AS TABLE lightmill.tokens; DELETE FROM lightmill.tokens");
  const Status refused = open_postgres(options()).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find("its table tokens has lost rows"), std::string::npos) << refused;
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), "8") << "a refused store is not changed";
  sql("INSERT INTO lightmill.tokens TABLE kept");
  for (const std::uint64_t epoch : {3u, 4u}) {
    const StoredState state = load_with_films(*opened(options()).store).value();
    EXPECT_EQ(describe(state), describe(state_of_the_format_before()));
    EXPECT_EQ(state.epoch, epoch);
  }
  sql("DELETE FROM lightmill.results WHERE tile = 3");
  EXPECT_EQ(stored().damaged, (std::vector<NodeKey>{{JobId{1}, TileId{0}, {1, 0}}, {JobId{1}, TileId{3}, {0, 4}}}));
  // The way back: the old tables under their old name.
  sql("DROP SCHEMA lightmill CASCADE; ALTER SCHEMA lightmill_format_8 RENAME TO lightmill");
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), "8");
  EXPECT_EQ(describe(load_with_films(*opened(options()).store).value()), describe(state_of_the_format_before()));
}

TEST_F(PostgresStoreTest, ADatabaseOfFormat9IsMigratedAndKept) {
  sql(read_file(source_file("tests/integration/store/format_9.sql")).value());
  EXPECT_EQ(sql("SELECT epoch || ' ' || commits FROM lightmill.turn"), "2 1");
  for (const std::uint64_t epoch : {3u, 4u}) {
    const PostgresStores stores = opened(options());
    const StoredState state = load_with_films(*stores.store).value();
    EXPECT_EQ(describe(state), describe(state_of_the_format_before()));
    EXPECT_EQ(state.epoch, epoch);
    EXPECT_TRUE(stores.assets->has(sha256("an asset")));
  }
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), std::to_string(postgres::kFormat));
  // The way back: the old tables under their old name.
  sql("DROP SCHEMA lightmill CASCADE; ALTER SCHEMA lightmill_format_9 RENAME TO lightmill");
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), "9");
  EXPECT_EQ(describe(load_with_films(*opened(options()).store).value()), describe(state_of_the_format_before()));
}

TEST_F(PostgresStoreTest, ADamagedDatabaseOfFormat9IsRefusedAndNotChanged) {
  sql(read_file(source_file("tests/integration/store/format_9.sql")).value());
  const std::array tables{"meta", "summary", "tokens", "turn"};
  sql("CREATE SCHEMA sound");
  for (const char* const table : tables) {
    sql(fmt::format("CREATE TABLE sound.{0} AS TABLE lightmill.{0}", table));
  }
  const auto content = [&] {
    return sql(
        "SELECT string_agg(query_to_xml(format('SELECT row::text FROM lightmill.%I AS row', relname), true, false, "
        "'')::text, relname ORDER BY relname) FROM pg_class WHERE relkind = 'r' AND relnamespace = "
        "'lightmill'::regnamespace");
  };
  struct Case {
    std::string damage, message;
    StatusCode code = StatusCode::kDataLoss;
  };
  const std::vector<Case> cases{
      {"UPDATE turn SET commits = 0", "the table turn is damaged: epoch 2, commit 0, highest job 3"},
      {"UPDATE turn SET epoch = 3", "the table turn is damaged: epoch 3, commit 1, highest job 3"},
      {"UPDATE turn SET highest_job = 2", "the table turn is damaged: epoch 2, commit 1, highest job 2"},
      {"DELETE FROM turn", "the tables turn, summary, lease and audit_secret must have one row each"},
      {"UPDATE summary SET checksum = checksum + 1", "the table summary has a wrong checksum"},
      {"UPDATE summary SET sums = set_bit(sums, 0, 1 - get_bit(sums, 0))", "the table summary has a wrong checksum"},
      {"UPDATE meta SET format = 8", "The table meta says format 8. This number or the tables are damaged"},
      {"DELETE FROM tokens", "its table tokens has lost rows", StatusCode::kFailedPrecondition}};
  for (const Case& one : cases) {
    SCOPED_TRACE(one.damage);
    sql("SET search_path = lightmill; " + one.damage);
    const std::string before = content();
    const Status refused = open_postgres(options()).status();
    EXPECT_EQ(refused.code(), one.code);
    EXPECT_NE(message_of(refused).find(one.message), std::string::npos) << refused;
    EXPECT_EQ(content(), before);
    EXPECT_EQ(sql("SELECT to_regnamespace('lightmill_format_9') IS NULL"), "t");
    for (const char* const table : tables) {
      sql(fmt::format("DELETE FROM lightmill.{0}; INSERT INTO lightmill.{0} TABLE sound.{0}", table));
    }
  }
  EXPECT_EQ(describe(load_with_films(*opened(options()).store).value()), describe(state_of_the_format_before()));
}

TEST_F(PostgresStoreTest, AMigrationFromFormat9KeepsTheSumsOfFilms) {
  sql(read_file(source_file("tests/integration/store/format_9.sql")).value());
  sql("DELETE FROM lightmill.results WHERE tile = 3");
  EXPECT_EQ(stored().damaged, (std::vector<NodeKey>{{JobId{1}, TileId{0}, {1, 0}}, {JobId{1}, TileId{3}, {0, 4}}}))
      << "its tiles share a sum, so they are rendered again";
}

TEST_F(PostgresStoreTest, ALostRowIsRefusedUntilTheLossIsAccepted) {
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store
                    ->commit(std::vector<StoreOp>{PutJob{full_record(1)}, PutJob{full_record(2)},
                                                  PutToken{{"t", "ada", Roles::all(), {}, "root", 1, 2}}})
                    .ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{DeleteJobRows{JobId{2}}}).ok()) << "this is no loss";
  }
  EXPECT_EQ(stored().jobs.size(), 1u);
  sql("DELETE FROM lightmill.tokens");
  const Status refused = opened(options()).store->load().status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find("its table tokens has lost rows"), std::string::npos) << refused;
  EXPECT_NE(message_of(refused).find("--accept-loss"), std::string::npos) << refused;
  PostgresOptions accepting = options();
  accepting.accept_loss = true;
  EXPECT_EQ(opened(accepting).store->load()->jobs.size(), 1u);
  EXPECT_TRUE(opened(options()).store->load().ok()) << "it was accepted once";
}

TEST_F(PostgresStoreTest, ADatabaseBehindTheRecordOfTheLastCommitIsRefusedUntilTheLossIsAccepted) {
  const TemporaryFolder folder;
  PostgresOptions recorded = options();
  recorded.chain = folder.path() / "postgres-chain";
  std::string backup;  // of the first epoch
  for (const std::uint64_t id : {1u, 2u}) {
    {
      const auto store = opened(recorded).store;
      ASSERT_TRUE(store->load().ok());
      ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(id)}}).ok());
    }
    backup = id == 1 ? server().dumped_and_restored(url_) : backup;
  }
  url_ = recorded.url = backup;
  const Status refused = open_postgres(recorded).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find("Jobs up to 2 and their results may be lost"), std::string::npos) << refused;
  EXPECT_NE(message_of(refused).find("--accept-loss"), std::string::npos) << refused;
  EXPECT_TRUE(open_postgres(options()).ok()) << "without a record it cannot know";
  recorded.accept_loss = true;
  {
    const StoredState state = opened(recorded).store->load().value();
    EXPECT_EQ(state.jobs.size(), 1u);
    EXPECT_EQ(state.next_job_id, 3u) << "the lost job's id is not reused";
  }
  recorded.accept_loss = false;
  EXPECT_TRUE(open_postgres(recorded).ok());
}

TEST_F(PostgresStoreTest, AStandbyRecordsTheOthersCommits) {
  const TemporaryFolder folder;
  const auto at_work = opened(options()).store;
  ASSERT_TRUE(at_work->load().ok());
  PostgresOptions waiting = options();
  waiting.chain = folder.path() / "postgres-chain";
  int looks = 0;
  waiting.wait = [&](std::chrono::milliseconds) {
    EXPECT_TRUE(at_work->commit(std::vector<StoreOp>{PutJob{full_record(7)}}).ok());
    return ++looks < 3;
  };
  EXPECT_EQ(open_postgres(waiting).status().code(), StatusCode::kCancelled);
  const std::optional<CommitMark> last = CommitChain::open(waiting.chain)->last();
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->commits, std::uint64_t{1} << 32 | 2) << "two of the first epoch, before it looked the last time";
  EXPECT_EQ(last->highest_job, 7u);
}

TEST_F(PostgresStoreTest, AForeignSchemaIsRefusedAndAnEmptyOneIsUsed) {
  sql("CREATE SCHEMA lightmill; CREATE TABLE lightmill.other (x BIGINT)");
  EXPECT_EQ(open_postgres(options()).status().code(), StatusCode::kFailedPrecondition) << "not to be overwritten";
  sql("DROP TABLE lightmill.other");
  EXPECT_TRUE(open_postgres(options()).ok());
}

TEST_F(PostgresStoreTest, ADatabaseWithoutUtf8IsRefusedWithARemedy) {
  url_ = server().new_database("LATIN1");
  const Status status = open_postgres(options()).status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(status).find("ENCODING 'UTF8'"), std::string::npos) << status;
}

TEST_F(PostgresStoreTest, ReadOnlyAccessCreatesNoFarmAndDoesNotWait) {
  PostgresOptions look = options();
  look.read_only = true;
  const Status none = open_postgres(look).status();
  EXPECT_EQ(none.code(), StatusCode::kNotFound);
  EXPECT_NE(message_of(none).find("there is no farm in "), std::string::npos) << none;
  EXPECT_EQ(sql("SELECT to_regnamespace('lightmill') IS NULL"), "t");
  {
    const PostgresStores at_work = opened(options());
    const Status busy = open_postgres(look).status();
    EXPECT_EQ(busy.code(), StatusCode::kFailedPrecondition);
    EXPECT_NE(message_of(busy).find("a coordinator uses it"), std::string::npos) << busy;
  }
  EXPECT_TRUE(open_postgres(look).ok());
}

TEST_F(PostgresStoreTest, AMissingServerIsReportedWithItsAddress) {
  PostgresOptions nowhere = options();
  nowhere.url = "postgres://someone:secret@127.0.0.1:1/farm";
  const Status status = open_postgres(nowhere).status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(message_of(status).find("127.0.0.1:1"), std::string::npos) << status;
  EXPECT_NE(message_of(status).find("farm"), std::string::npos) << status;
  EXPECT_EQ(message_of(status).find("secret"), std::string::npos) << status;
  EXPECT_FALSE(check_postgres_url("postgres://host/x?nonsense=1").ok());
  EXPECT_TRUE(check_postgres_url(url_).ok());
}

TEST_F(PostgresStoreTest, TextsOfAnyBytesCanBeStored) {
  JobRecord record = full_record(1);
  record.reason = std::string("zero \0 and \xff", 12);
  const auto store = opened(options()).store;
  ASSERT_TRUE(store->load().ok());
  const Status status = store->commit(std::vector<StoreOp>{PutJob{record}});
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(store->load()->jobs.at(0).record.reason, record.reason);
}

}  // namespace
}  // namespace lightmill::test
