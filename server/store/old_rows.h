// Reader of the previous formats (12 of SQLite, 6 of PostgreSQL), for the migration (server/store/migration.h).
//
// They had one column per value, names for enumerators, and one checksum over all rows of a job.
#pragma once

#include "server/domain/stored_rows.h"
#include "server/store/row_source.h"

namespace lightmill::stored {

/// Reads all but nodes, the secret, the epoch and the next job id. Damaged rows are logged and left out.
Status load_old_rows(RowSource& rows, StoredState& state);

}  // namespace lightmill::stored
