// The embedded store: one SQLite file, WAL, every commit durable when it returns.
#pragma once

#include <filesystem>
#include <memory>

#include "server/store/store.h"

namespace lightmill {

/// Version of the tables in the file; kept in PRAGMA user_version.
inline constexpr int kSqliteFormatVersion = 13;

struct SqliteOptions {
  bool accept_loss = false;  ///< go on with a database that has lost acknowledged commits
};

/// Opens or creates the store's file, and beside it the record of the last commit (commit_chain.h). FAILED_PRECONDITION
/// if it has another format, or is something else's; DATA_LOSS if it is no database, is damaged, or has lost commits
/// that were acknowledged. A store that is refused stays as it is. The caller holds the lock of the data directory
/// (server/store/data_directory.h).
///
/// Nodes carry a checksum. One that is damaged is logged and left out by load(), so that its range is rendered again.
Result<std::unique_ptr<Store>> open_sqlite_store(const std::filesystem::path& file, const SqliteOptions& options = {});

}  // namespace lightmill
