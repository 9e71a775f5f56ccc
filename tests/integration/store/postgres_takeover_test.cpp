// Lost connections to PostgreSQL, and several coordinators on one database.
#include <atomic>
#include <future>

#include "server/store/postgres/session.h"
#include "tests/integration/store/postgres_fixture.h"
#include "tests/support/fault_proxy.h"

namespace lightmill::test {
namespace {

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
  // The commit waits for its last write until the way back is closed.
  postgres::Session other({url_, "test"}, {}, std::chrono::minutes(1));
  ASSERT_TRUE(other.execute("BEGIN; LOCK TABLE summary").ok());
  std::future<Status> committed = std::async(std::launch::async, [&] { return store->commit(ops); });
  EXPECT_TRUE(eventually([&] {
    return sql("SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock'") ==
           "1";
  }));
  proxy.swallow(Way::back, true);
  ASSERT_TRUE(other.execute("ROLLBACK").ok());
  EXPECT_TRUE(eventually([&] { return sql("SELECT commits FROM lightmill.current_epoch") == "2"; }));
  proxy.swallow(Way::back, false);
  proxy.cut();
  const Status status = committed.get();
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(sql("SELECT commits FROM lightmill.current_epoch"), "2");
  const StoredState state = store->load().value();
  ASSERT_EQ(state.jobs.size(), 1u);
  EXPECT_EQ(state.jobs[0].record.id, JobId{2});
  EXPECT_TRUE(state.damaged.empty()) << "its sums are known";
}

TEST_F(PostgresStoreTest, ACommitThatNeverReachedTheServerIsStored) {
  FaultProxy proxy(server().socket_file());
  const auto store = opened(options_for(PostgresServer::over_tcp(url_, proxy.port()))).store;
  ASSERT_TRUE(store->load().ok());
  proxy.cut();
  EXPECT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(1)}}).ok());
  EXPECT_EQ(store->load()->jobs.size(), 1u);
}

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
      EXPECT_TRUE(eventually([this] {
        return sql("SELECT count(*) FROM pg_stat_activity WHERE application_name = 'lightmill-server killed'") == "0";
      }));
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
  ASSERT_TRUE(stopped.execute("BEGIN; SELECT begin_commit(1, 1); CREATE TABLE late (x BIGINT)").ok());
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
