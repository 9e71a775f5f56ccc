// Loader of the coordinator's state from an SQLite store.
#pragma once

#include "server/store/records.h"
#include "server/store/sqlite/database.h"
#include "server/store/store.h"

namespace lightmill::sqlite {

/// Reads all jobs with their nodes and results, and all small rows, in the caller's transaction. It does not read the
/// epoch, the secret, or the values of ended jobs' nodes. Damaged rows are logged; such jobs are left out, and such
/// nodes are removed. The caller applies `repairs` in the same transaction. `specs` learns which specifications are
/// stored.
Result<StoredState> load_state(Database& database, stored::StoredSpecs& specs, std::vector<StoreOp>& repairs);

/// Implements Store::read_film().
Result<FilmPiece> read_film(Database& database, JobId job, const FilmPosition& after);

/// Keys of all small rows.
Result<stored::RowKeys> load_keys(Database& database);

}  // namespace lightmill::sqlite
