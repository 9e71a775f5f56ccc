// The store in a PostgreSQL database, which coordinators on several machines can share: one is at work, others stand
// by.
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
  /// A coordinator that is not heard for so long is replaced by one that stands by.
  std::chrono::milliseconds lease = std::chrono::milliseconds(2'500);
  /// No tables are made, and nobody is waited for: NOT_FOUND where there is no farm, FAILED_PRECONDITION where a
  /// coordinator is at work.
  bool only_look = false;
  /// Where this coordinator records the last commit that it knows of (commit_chain.h); empty: nowhere.
  std::filesystem::path chain = {};
  bool accept_loss = false;  ///< go on with a database that is behind that record
  /// Waits so long; false if the coordinator is to stop instead of standing by.
  std::function<bool(std::chrono::milliseconds)> wait;
  /// Another coordinator has taken over, and nothing can be stored here any more. Called once, from another thread.
  std::function<void(const Status&)> on_deposed;
};

/// Whether `url` can be one; INVALID_ARGUMENT. Asks no server.
Status check_postgres_url(const std::string& url);

struct PostgresStores {
  std::unique_ptr<Store> store;
  std::unique_ptr<AssetStore> assets;  ///< in the same database
  std::string place;                   ///< for people, without the password
};

/// Makes the tables in the schema `lightmill` if there are none, and waits until no other coordinator is at work on
/// them. UNAVAILABLE if there is no connection, FAILED_PRECONDITION if the tables have another format, the schema is
/// something else's, or the database has lost commits that were acknowledged, CANCELLED if options.wait ended the
/// waiting.
///
/// Every transaction is checked to be of the current epoch, so that a coordinator that was deposed stores nothing.
/// While the database is away, commits fail with UNAVAILABLE and can be repeated: what is stored already is not stored
/// twice.
Result<PostgresStores> open_postgres(PostgresOptions options);

}  // namespace lightmill
