// Store in a PostgreSQL database that coordinators on several machines share: one is active, the others are standbys.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/store/asset_store.h"
#include "server/store/store.h"

namespace lightmill {

struct PostgresOptions {
  std::string url;  ///< postgres://USER@HOST:PORT/DATABASE, as libpq takes it
  AssetLimits assets;
  /// A standby coordinator takes over after this time without a renewal.
  std::chrono::milliseconds lease = std::chrono::milliseconds(2'500);
  /// Creates no tables and does not wait. NOT_FOUND if there is no farm, FAILED_PRECONDITION if a coordinator is
  /// active.
  bool read_only = false;
  /// File of the commit chain (commit_chain.h). Empty: no chain.
  std::filesystem::path chain = {};
  bool accept_loss = false;  ///< start with a database that is behind the commit chain
  /// Waits for the given time. False if the standby is to stop.
  std::function<bool(std::chrono::milliseconds)> wait;
  /// Called once from another thread when another coordinator has taken over. This one can store nothing afterwards.
  std::function<void(const Status&)> on_deposed;
};

/// INVALID_ARGUMENT unless `url` is valid. Contacts no server.
Status check_postgres_url(const std::string& url);

struct PostgresStores {
  std::unique_ptr<Store> store;
  std::unique_ptr<AssetStore> assets;  ///< in the same database
  std::string place;                   ///< for people, without the password
};

/// Creates missing tables in the schema `lightmill`, and waits until no other coordinator is active.
/// - UNAVAILABLE: no connection.
/// - FAILED_PRECONDITION: the tables have another format, the schema belongs to another program, or acknowledged
///   commits or rows are lost.
/// - DATA_LOSS: a row that all coordinators need is damaged.
/// - CANCELLED: options.wait ended the wait.
///
/// Every transaction checks the epoch, so a deposed coordinator stores nothing. While the database is away, commits
/// fail with UNAVAILABLE and can be repeated. A repeated commit is stored once.
Result<PostgresStores> open_postgres(PostgresOptions options);

}  // namespace lightmill
