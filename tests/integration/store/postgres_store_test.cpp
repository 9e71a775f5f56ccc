// The PostgreSQL store on a real server: the tests of every store, and its own.
#include "server/store/postgres/postgres_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "common/base/file.h"
#include "server/store/commit_chain.h"
#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/migrations.h"
#include "server/store/postgres/schema.h"
#include "server/store/row_values.h"
#include "tests/support/fault_proxy.h"
#include "tests/support/places.h"
#include "tests/support/postgres_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/asset_conformance.h"
#include "tests/unit/store/store_conformance.h"

namespace lightmill::test {
namespace {

PostgresServer& server() {
  static PostgresServer one;
  return one;
}

PostgresOptions options_for(const std::string& url) {
  PostgresOptions options;
  options.url = url;
  options.wait = [](std::chrono::milliseconds pause) {
    std::this_thread::sleep_for(pause);
    return true;
  };
  options.on_deposed = [](const Status& why) { ADD_FAILURE() << why; };
  return options;
}

PostgresStores opened(const PostgresOptions& options) {
  Result<PostgresStores> stores = open_postgres(options);
  EXPECT_TRUE(stores.ok()) << stores.status();
  return std::move(stores).value();
}

std::string damaging(std::uint32_t tile) {
  return fmt::format(
      "UPDATE lightmill.nodes SET samples = decode(repeat('00', length(samples)), 'hex') WHERE tile = {}", tile);
}

class PostgresPlace final : public StorePlace {
 public:
  std::unique_ptr<Store> open() override { return opened(options_for(url_)).store; }
  void damage_tile(std::uint32_t tile) override { run_sql(url_, damaging(tile)); }
  void update(const std::string& table, const std::string& change) override {
    run_sql(url_, fmt::format("UPDATE lightmill.{} SET {}", table, change));
  }

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

class PostgresStoreTest : public ::testing::Test {
 protected:
  PostgresOptions options() { return options_for(url_); }
  std::string sql(const std::string& text) { return run_sql(url_, text); }
  StoredState stored() { return opened(options()).store->load().value(); }
  /// Closes all connections to the database.
  void cut_all() {
    sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() AND pid <> "
        "pg_backend_pid()");
  }

  std::string url_ = server().new_database();
};

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
                " has store format 9, newer than format 8 of this lightmill-server: use the newer lightmill-server "
                "that wrote it, or choose another database with --store");
  EXPECT_EQ(refusal_after(fmt::format("UPDATE lightmill.meta SET format = {}", postgres::kFormatBefore - 1)),
            place +
                " has store format 5, older than format 8 of this lightmill-server: use the older lightmill-server "
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

TEST_F(PostgresStoreTest, ADatabaseOfFormat7IsUpgradedInPlace) {
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
  // As format 7 has it: no summary, and hashes of nodes without their place.
  sql(fmt::format(
      "DROP TABLE lightmill.summary; UPDATE lightmill.meta SET format = {}; UPDATE lightmill.nodes SET hash "
      "= {}",
      postgres::kFormat7, literal_of(hash_of(*node))));
  sql("UPDATE lightmill.lease SET expires = clock_timestamp() + interval '1 hour'");
  EXPECT_EQ(open_postgres(options()).status().code(), StatusCode::kFailedPrecondition) << "a coordinator uses it";
  sql("UPDATE lightmill.lease SET expires = '-infinity'");
  for (int start = 0; start < 2; ++start) {
    EXPECT_EQ(describe(load_with_films(*opened(options()).store).value()), before);
    EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), std::to_string(postgres::kFormat));
  }
}

TEST_F(PostgresStoreTest, ALostRowIsRefusedUntilThatIsAccepted) {
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
  const Status refused = open_postgres(options()).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find("its table tokens has lost rows"), std::string::npos) << refused;
  EXPECT_NE(message_of(refused).find("--accept-loss"), std::string::npos) << refused;
  PostgresOptions accepting = options();
  accepting.accept_loss = true;
  EXPECT_EQ(opened(accepting).store->load()->jobs.size(), 1u);
  EXPECT_TRUE(open_postgres(options()).ok()) << "it was accepted once";
}

TEST_F(PostgresStoreTest, ADatabaseBehindTheRecordOfTheLastCommitIsRefusedUntilThatIsAccepted) {
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

// ---- lost connections ----

TEST_F(PostgresStoreTest, ALostConnectionIsRestored) {
  const PostgresStores stores = opened(options());
  ASSERT_TRUE(stores.store->load().ok());
  ASSERT_TRUE(stores.store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  const auto upload = stores.assets->start_upload(sha256("asset")).value();
  ASSERT_TRUE(upload->append(as_byte_view("asset")).ok());
  cut_all();
  EXPECT_TRUE(stores.store->commit(std::vector<StoreOp>{PutJob{full_record(2)}}).ok());
  EXPECT_TRUE(upload->finish().ok());
  cut_all();
  EXPECT_EQ(stores.assets->open_asset(sha256("asset")).value()->next(100).value(), "asset");
  EXPECT_EQ(stores.store->load()->jobs.size(), 2u);
}

TEST_F(PostgresStoreTest, WhileTheServerIsAwayNothingIsLost) {
  const auto store = opened(options()).store;
  ASSERT_TRUE(store->load().ok());
  const std::vector<StoreOp> first{PutJob{full_record(1)}}, second{PutJob{full_record(2)}};
  ASSERT_TRUE(store->commit(first).ok());
  server().stop();
  EXPECT_EQ(store->commit(second).code(), StatusCode::kUnavailable);
  EXPECT_EQ(store->commit(second).code(), StatusCode::kUnavailable);
  server().start();
  const Status status = store->commit(second);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(store->load()->jobs.size(), 2u);
}

TEST_F(PostgresStoreTest, ACommitWhoseAnswerIsLostIsStoredOnce) {
  FaultProxy proxy(server().socket_file());
  const auto store = opened(options_for(PostgresServer::over_tcp(url_, proxy.port()))).store;
  ASSERT_TRUE(store->load().ok());
  ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  // The second time, the node would have no job.
  const std::vector<StoreOp> ops{PutNode{JobId{1}, TileId{0}, small_node(0, 0, 1)}, DeleteJobRows{JobId{1}},
                                 PutJob{full_record(2)}};
  proxy.swallow(Way::back, true);
  std::future<Status> committed = std::async(std::launch::async, [&] { return store->commit(ops); });
  EXPECT_TRUE(eventually([&] { return sql("SELECT commits FROM lightmill.turn") == "2"; }));
  proxy.swallow(Way::back, false);
  proxy.cut();
  const Status status = committed.get();
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(sql("SELECT commits FROM lightmill.turn"), "2");
  const StoredState state = store->load().value();
  ASSERT_EQ(state.jobs.size(), 1u);
  EXPECT_EQ(state.jobs[0].record.id, JobId{2});
}

TEST_F(PostgresStoreTest, ACommitThatNeverReachedTheServerIsStored) {
  FaultProxy proxy(server().socket_file());
  const auto store = opened(options_for(PostgresServer::over_tcp(url_, proxy.port()))).store;
  ASSERT_TRUE(store->load().ok());
  proxy.cut();
  EXPECT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  EXPECT_EQ(store->load()->jobs.size(), 1u);
}

// ---- several coordinators ----

TEST_F(PostgresStoreTest, ASecondCoordinatorWaitsUntilTheFirstLeaves) {
  std::optional<PostgresStores> first = opened(options());
  const std::uint64_t epoch = first->store->load()->epoch;
  std::atomic<int> looks = 0;
  PostgresOptions waiting = options();
  waiting.wait = [&](std::chrono::milliseconds) {
    if (++looks == 3) {
      first.reset();
    }
    return true;
  };
  const PostgresStores second = opened(waiting);
  EXPECT_EQ(looks, 3);
  EXPECT_EQ(second.store->load()->epoch, epoch + 1);
}

TEST_F(PostgresStoreTest, AStandbyCanBeStopped) {
  const PostgresStores first = opened(options());
  PostgresOptions stopped = options();
  stopped.wait = [](std::chrono::milliseconds) { return false; };
  EXPECT_EQ(open_postgres(stopped).status().code(), StatusCode::kCancelled);
}

TEST_F(PostgresStoreTest, AKilledCoordinatorIsReplacedWhenItsLeaseExpires) {
  stored();
  // The lease as the killed coordinator leaves it, only longer.
  sql("UPDATE lightmill.lease SET instance = 'killed', expires = clock_timestamp() + interval '1 hour'");
  int looks = 0;
  PostgresOptions waiting = options();
  waiting.wait = [&](std::chrono::milliseconds pause) {
    EXPECT_LE(pause, std::chrono::seconds(1)) << "it does not take over much later than it could";
    if (++looks == 3) {
      sql("UPDATE lightmill.lease SET expires = clock_timestamp()");
    }
    return true;
  };
  EXPECT_EQ(opened(waiting).store->load()->epoch, 2u);
  EXPECT_EQ(looks, 3);
}

TEST_F(PostgresStoreTest, ADisconnectedCoordinatorIsReplacedBeforeItsLeaseExpires) {
  stored();
  // An active coordinator: a connection, and the lease.
  auto killed = std::make_unique<postgres::Session>(postgres::Target{url_, "lightmill-server killed"},
                                                    std::span<const char* const>(), std::chrono::seconds(10));
  ASSERT_TRUE(killed->connect().ok());
  sql("UPDATE lightmill.lease SET instance = 'killed', expires = clock_timestamp() + interval '1 hour'");
  int looks = 0;
  PostgresOptions waiting = options();
  waiting.wait = [&](std::chrono::milliseconds pause) {
    std::this_thread::sleep_for(pause);
    if (++looks == 3) {
      killed.reset();
    }
    return looks < 100;
  };
  EXPECT_EQ(opened(waiting).store->load()->epoch, 2u);
  EXPECT_LE(looks, 8) << "three while it is there, and four without it";
}

TEST_F(PostgresStoreTest, ADeposedCoordinatorStoresNothing) {
  std::atomic<int> deposed = 0;
  PostgresOptions of_first = options();
  of_first.lease = std::chrono::seconds(1);
  of_first.on_deposed = [&](const Status& why) {
    EXPECT_EQ(why.code(), StatusCode::kFailedPrecondition);
    EXPECT_NE(message_of(why).find("taken over"), std::string::npos) << why;
    ++deposed;
  };
  const PostgresStores first = opened(of_first);
  ASSERT_TRUE(first.store->load().ok());
  ASSERT_TRUE(first.store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  const auto upload = first.assets->start_upload(sha256("late")).value();
  ASSERT_TRUE(upload->append(as_byte_view("late")).ok());

  // As if it were stopped for longer than its lease.
  PostgresOptions of_second = options();
  of_second.wait = [&](std::chrono::milliseconds) {
    sql("UPDATE lightmill.lease SET expires = '-infinity'");
    return true;
  };
  const PostgresStores second = opened(of_second);
  EXPECT_EQ(second.store->load()->jobs.size(), 1u);

  const std::vector<StoreOp> late{DeleteJobRows{JobId{1}}, PutJob{full_record(2)}};
  EXPECT_EQ(first.store->commit(late).code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(upload->finish().code(), StatusCode::kUnavailable);
  EXPECT_EQ(first.assets->collect({}, -1), 0u);
  EXPECT_TRUE(eventually([&] { return deposed == 1; }));
  EXPECT_TRUE(second.store->commit(std::vector<StoreOp>{PutJob{full_record(3)}}).ok());
  const StoredState state = second.store->load().value();
  ASSERT_EQ(state.jobs.size(), 2u);
  EXPECT_EQ(state.jobs[0].record.id, JobId{1});
  EXPECT_EQ(state.jobs[1].record.id, JobId{3});
  EXPECT_FALSE(second.assets->has(sha256("late")));
}

TEST_F(PostgresStoreTest, AnOpenTransactionOfADeposedCoordinatorIsEnded) {
  PostgresOptions of_first = options();
  of_first.on_deposed = [](const Status&) {};
  const PostgresStores first = opened(of_first);
  ASSERT_TRUE(first.store->load().ok());
  // A connection of the first coordinator that stopped in the middle of a commit, with its locks.
  const std::string instance = sql("SELECT instance FROM lightmill.lease");
  postgres::Session stopped({url_, "lightmill-server " + instance}, {}, std::chrono::seconds(5));
  ASSERT_TRUE(stopped.execute("BEGIN; SELECT take_turn(1, 1); CREATE TABLE late (x BIGINT)").ok());
  PostgresOptions of_second = options();
  of_second.wait = [&](std::chrono::milliseconds) {
    sql("UPDATE lightmill.lease SET expires = '-infinity'");
    return true;
  };
  const PostgresStores second = opened(of_second);
  EXPECT_EQ(second.store->load()->epoch, 2u);
  EXPECT_FALSE(stopped.execute("COMMIT").ok());
  EXPECT_EQ(sql("SELECT to_regclass('lightmill.late') IS NULL"), "t");
}

}  // namespace
}  // namespace lightmill::test
