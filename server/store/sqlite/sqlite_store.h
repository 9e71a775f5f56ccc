// The embedded store: one SQLite file in WAL mode. A commit is durable when it returns.
#pragma once

#include <filesystem>
#include <memory>

#include "server/store/store.h"

namespace lightmill {

/// Format version, in PRAGMA user_version.
inline constexpr int kSqliteFormatVersion = 15;
/// Since this version, only the store's own row has changed. In rows of nodes, stored::node_of also accepts the older
/// hash.
inline constexpr int kSameRowsVersion = 13;

struct SqliteOptions {
  bool accept_loss = false;  ///< start with a database that has lost acknowledged commits
};

/// Whether the commit chain next to the store's file has a mark. The file itself may be gone. Creates nothing.
bool sqlite_has_acknowledged(const std::filesystem::path& file);

/// Opens or creates the store's file, and next to it the commit chain (commit_chain.h). The caller holds
/// the lock of the data folder (server/store/data_folder.h). A refused store is not changed.
/// - FAILED_PRECONDITION: another format, or another program's file. From load(): small rows are lost or outdated.
/// - DATA_LOSS: not a database, damaged, or acknowledged commits are lost.
/// load() logs damaged nodes and leaves them out. Tiles with lost or old rows of nodes or results are rendered again.
Result<std::unique_ptr<Store>> open_sqlite_store(const std::filesystem::path& file, const SqliteOptions& options = {});

}  // namespace lightmill
