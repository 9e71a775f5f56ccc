// The embedded store: one SQLite file, WAL, every commit durable when it returns.
#pragma once

#include <filesystem>
#include <memory>

#include "server/store/store.h"

namespace lightmill {

/// Version of the tables in the file; kept in PRAGMA user_version.
inline constexpr int kSqliteFormatVersion = 12;

/// Opens or creates the store's file. FAILED_PRECONDITION if it has another format, or is something else's; DATA_LOSS
/// if it is no database or is damaged. The caller holds the lock of the data directory (server/store/data_directory.h).
///
/// Nodes carry a checksum. One that is damaged is logged and left out by load(), so that its range is rendered again.
Result<std::unique_ptr<Store>> open_sqlite_store(const std::filesystem::path& file);

}  // namespace lightmill
