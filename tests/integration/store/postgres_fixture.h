// Stores in databases of a PostgreSQL server that the program's tests share.
#pragma once

#include <gtest/gtest.h>

#include <thread>

#include "server/store/postgres/postgres_store.h"
#include "tests/support/postgres_server.h"
#include "tests/unit/store/stored_examples.h"

namespace lightmill::test {

inline PostgresServer& server() {
  static PostgresServer one;
  return one;
}

inline PostgresOptions options_for(const std::string& url) {
  PostgresOptions options;
  options.url = url;
  options.wait = [](std::chrono::milliseconds pause) {
    std::this_thread::sleep_for(pause);
    return true;
  };
  options.on_deposed = [](const Status& why) { ADD_FAILURE() << why; };
  return options;
}

inline PostgresStores opened(const PostgresOptions& options) {
  Result<PostgresStores> stores = open_postgres(options);
  EXPECT_TRUE(stores.ok()) << stores.status();
  return std::move(stores).value();
}

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

}  // namespace lightmill::test
