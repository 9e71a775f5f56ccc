// Tables and settings of the SQLite store's file, format 15.
#pragma once

#include "server/store/sqlite/journal_scan.h"
#include "server/store/sqlite/store_row.h"

namespace lightmill::sqlite {

/// "LMIL": the PRAGMA application_id of our files.
inline constexpr int kApplicationId = 0x4C4D494C;

/// Id of the last job, even of a deleted one.
inline constexpr const char* kHighestJob = "SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'jobs'";

inline constexpr const char* kLossAdvice =
    "Restore a backup of the whole data folder, or start once with --accept-loss to continue with what is left";

/// Applies the settings and checks the format. `is_new`: the file did not exist. `may_be_new`: nothing was ever
/// acknowledged here, so an empty file gets its tables and the values of `first`.
Status prepare_file(Database& database, const std::filesystem::path& file, bool is_new, bool may_be_new,
                    const JournalScan& journal, const Beginning& first);

}  // namespace lightmill::sqlite
