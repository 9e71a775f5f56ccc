// Reader of earlier formats, for the migration (server/store/migration.h).
#pragma once

#include <string_view>

#include "server/domain/stored_rows.h"
#include "server/store/row_source.h"

namespace lightmill::stored {

/// Reads all of formats 12 (SQLite) and 6 (PostgreSQL) but nodes, the secret, the epoch and the next job id. Damaged
/// rows are logged and left out. These formats had one column per value, names for enumerators, and one checksum over
/// all rows of a job.
Status load_old_rows(RowSource& rows, StoredState& state);

/// Compares the keys of small rows with the sums of formats 13 and 14 (SQLite) and 8 (PostgreSQL). FAILED_PRECONDITION
/// if rows are lost.
Status check_old_sums(RowSource& rows, std::string_view sums);

}  // namespace lightmill::stored
