// The store in PostgreSQL, against a real server: what every store does, and what only this one does.
#include "server/store/postgres/postgres_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/schema.h"
#include "tests/support/fault_proxy.h"
#include "tests/support/postgres_server.h"
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

/// Takes what later formats have brought out of the tables.
constexpr const char* kBackToFormat5 =
    "ALTER TABLE lightmill.jobs DROP COLUMN checksum; ALTER TABLE lightmill.results DROP COLUMN checksum;";
constexpr const char* kBackToFormat4 =
    "ALTER TABLE lightmill.jobs DROP COLUMN checksum; ALTER TABLE lightmill.results DROP COLUMN checksum;"
    "ALTER TABLE lightmill.jobs DROP COLUMN allow_mixed; ALTER TABLE lightmill.results DROP COLUMN fingerprint_class;";
constexpr const char* kBackToFormat3 =
    "ALTER TABLE lightmill.jobs DROP COLUMN checksum; ALTER TABLE lightmill.results DROP COLUMN checksum;"
    "ALTER TABLE lightmill.jobs DROP COLUMN allow_mixed; ALTER TABLE lightmill.results DROP COLUMN fingerprint_class;"
    "ALTER TABLE lightmill.jobs DROP COLUMN verify_share, DROP COLUMN results_verified, DROP COLUMN nodes_dropped;"
    "ALTER TABLE lightmill.results DROP COLUMN machine, DROP COLUMN verification;"
    "DROP TABLE lightmill.quarantine, lightmill.verification_secret;";

class PostgresStoreTest : public ::testing::Test {
 protected:
  PostgresOptions options() { return options_for(url_); }
  std::string sql(const std::string& text) { return run_sql(url_, text); }
  StoredState stored() { return opened(options()).store->load().value(); }
  /// Ends all connections to the database.
  void cut_all() {
    sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() AND pid <> "
        "pg_backend_pid()");
  }

  std::string url_ = server().new_database();
};

TEST_F(PostgresStoreTest, ANewerFormatIsRefusedWithWhatToDo) {
  stored();
  sql("UPDATE lightmill.meta SET format = 99");
  const Status status = open_postgres(options()).status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(status).find("use the newer lightmill-server"), std::string::npos) << status;
  EXPECT_NE(message_of(status).find("format 99"), std::string::npos) << status;
  sql(fmt::format("UPDATE lightmill.meta SET format = {}", postgres::kFormat));
  EXPECT_TRUE(open_postgres(options()).ok()) << "nothing was changed";
}

TEST_F(PostgresStoreTest, TablesOfFormat1AreBroughtUpToDate) {
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  }
  const Sha256 secret = stored().secret;
  sql(std::string(kBackToFormat3) +
      "DROP TABLE lightmill.tokens, lightmill.actions; UPDATE lightmill.meta SET format = 1");
  const TokenRecord token{"00112233aabb", "ada", {Role::submit}, sha256("one"), "root", 1, 2};
  {
    const auto store = opened(options()).store;
    const Result<StoredState> state = store->load();
    ASSERT_TRUE(state.ok()) << state.status();
    EXPECT_TRUE(state->tokens.empty());
    ASSERT_EQ(state->jobs.size(), 1u);
    EXPECT_EQ(state->jobs[0].record.spec.verify_share, kVerifyShare);
    EXPECT_NE(state->secret, secret);
    EXPECT_NE(state->secret, Sha256{});
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutToken{token}}).ok());
  }
  EXPECT_EQ(stored().tokens, std::vector{token});
  EXPECT_EQ(sql("SELECT format FROM lightmill.meta"), std::to_string(postgres::kFormat));
}

TEST_F(PostgresStoreTest, TablesOfFormat3AreBroughtUpToDate) {
  const NodeKey key{JobId{1}, TileId{0}, {0, 0}};
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    const PutResult result{key, Hash128{1, 2}, {"worker", "machine"}, true};
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}, result}).ok());
  }
  sql(std::string(kBackToFormat3) + "UPDATE lightmill.meta SET format = 3");
  const QuarantineRecord quarantine{{"liar", "m"}, "wrong", 3};
  {
    const auto store = opened(options()).store;
    const Result<StoredState> state = store->load();
    ASSERT_TRUE(state.ok()) << state.status();
    ASSERT_EQ(state->jobs.size(), 1u);
    EXPECT_EQ(state->jobs[0].record.spec.verify_share, kVerifyShare);
    EXPECT_EQ(state->jobs[0].record.counters.results_verified, 0u);
    ASSERT_EQ(state->jobs[0].results.size(), 1u);
    EXPECT_EQ(state->renderers.at(state->jobs[0].results[0].by), (Renderer{"worker", ""}));
    EXPECT_FALSE(state->jobs[0].results[0].to_verify);
    EXPECT_NE(state->secret, Sha256{});
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutQuarantine{quarantine}}).ok());
  }
  EXPECT_EQ(stored().quarantine, std::vector{quarantine});
}

TEST_F(PostgresStoreTest, TablesOfFormat4AreBroughtUpToDate) {
  const PutResult result{{JobId{1}, TileId{0}, {0, 0}}, Hash128{1, 2}, {"worker", "machine", "class"}, true};
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}, result}).ok());
  }
  sql(std::string(kBackToFormat4) + "UPDATE lightmill.meta SET format = 4");
  {
    const auto store = opened(options()).store;
    const Result<StoredState> state = store->load();
    ASSERT_TRUE(state.ok()) << state.status();
    ASSERT_EQ(state->jobs.size(), 1u);
    EXPECT_FALSE(state->jobs[0].record.spec.allow_mixed);
    EXPECT_EQ(state->jobs[0].record.spec.verify_share, full_record(1).spec.verify_share);
    ASSERT_EQ(state->jobs[0].results.size(), 1u);
    EXPECT_EQ(state->renderers.at(state->jobs[0].results[0].by), (Renderer{"worker", "machine"}));
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(2)}, result}).ok());
  }
  const StoredState after = stored();
  EXPECT_TRUE(after.jobs.at(1).record.spec.allow_mixed);
  EXPECT_EQ(after.renderers.at(after.jobs.at(0).results.at(0).by), result.by);
}

TEST_F(PostgresStoreTest, JobsOfFormat5GetTheirChecksums) {
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  }
  sql(std::string(kBackToFormat5) + "UPDATE lightmill.meta SET format = 5");
  EXPECT_EQ(stored().jobs.size(), 1u);
  sql("UPDATE lightmill.job_settings SET seed = seed + 1");
  EXPECT_EQ(stored().damaged_jobs, std::vector{JobId{1}});
}

TEST_F(PostgresStoreTest, TablesOfFormat2AreBroughtUpToDate) {
  stored();
  sql(std::string(kBackToFormat3) + "DROP TABLE lightmill.actions; UPDATE lightmill.meta SET format = 2");
  const Action action{1, 2, "ada", Proof::none, "", "", "CancelJob", 3, "", StatusCode::kOk, ""};
  {
    const auto store = opened(options()).store;
    ASSERT_TRUE(store->load().ok());
    ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutAction{action}}).ok());
  }
  EXPECT_EQ(stored().actions, std::vector{action});
}

TEST_F(PostgresStoreTest, ASchemaOfSomethingElseIsRefusedAndAnEmptyOneTaken) {
  sql("CREATE SCHEMA lightmill; CREATE TABLE lightmill.other (x BIGINT)");
  EXPECT_EQ(open_postgres(options()).status().code(), StatusCode::kFailedPrecondition) << "not to be overwritten";
  sql("DROP TABLE lightmill.other");
  EXPECT_TRUE(open_postgres(options()).ok());
}

TEST_F(PostgresStoreTest, ADatabaseWithoutUtf8IsRefusedWithWhatToDo) {
  url_ = server().new_database("LATIN1");
  const Status status = open_postgres(options()).status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(status).find("ENCODING 'UTF8'"), std::string::npos) << status;
}

TEST_F(PostgresStoreTest, WhoOnlyLooksMakesNoFarmAndWaitsForNobody) {
  PostgresOptions look = options();
  look.only_look = true;
  const Status none = open_postgres(look).status();
  EXPECT_EQ(none.code(), StatusCode::kNotFound);
  EXPECT_NE(message_of(none).find("there is no farm in "), std::string::npos) << none;
  EXPECT_EQ(sql("SELECT to_regnamespace('lightmill') IS NULL"), "t");
  {
    const PostgresStores at_work = opened(options());
    const Status busy = open_postgres(look).status();
    EXPECT_EQ(busy.code(), StatusCode::kFailedPrecondition);
    EXPECT_NE(message_of(busy).find("a coordinator is at work on it"), std::string::npos) << busy;
  }
  EXPECT_TRUE(open_postgres(look).ok());
}

TEST_F(PostgresStoreTest, NoServerIsSaidWithItsAddress) {
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
  EXPECT_EQ(store->load()->jobs.at(0).record.reason, "zero \\x00 and \\xff");
}

// ---- connections that are lost ----

TEST_F(PostgresStoreTest, ALostConnectionIsMadeAgain) {
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
  // A second time, the node would have no job.
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

TEST_F(PostgresStoreTest, ASecondOneStandsByUntilTheFirstLeaves) {
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

TEST_F(PostgresStoreTest, OneThatStandsByCanBeStopped) {
  const PostgresStores first = opened(options());
  PostgresOptions stopped = options();
  stopped.wait = [](std::chrono::milliseconds) { return false; };
  EXPECT_EQ(open_postgres(stopped).status().code(), StatusCode::kCancelled);
}

TEST_F(PostgresStoreTest, OneThatIsKilledIsReplacedWhenItsLeaseRunsOut) {
  stored();
  // As it leaves the lease:
  sql("UPDATE lightmill.lease SET instance = 'killed', expires = clock_timestamp() + interval '1 second'");
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(stored().epoch, 2u);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(900));
}

TEST_F(PostgresStoreTest, ADeposedOneStoresNothing) {
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

  // As if it were stopped for longer than its lease:
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

TEST_F(PostgresStoreTest, ATransactionOfADeposedOneThatIsUnderWayIsEnded) {
  PostgresOptions of_first = options();
  of_first.on_deposed = [](const Status&) {};
  const PostgresStores first = opened(of_first);
  ASSERT_TRUE(first.store->load().ok());
  // A connection of the first that was stopped in the middle of a commit, with its locks.
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
