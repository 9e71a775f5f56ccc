// From rows to the state that a coordinator starts with.
#pragma once

#include "server/store/records.h"
#include "server/store/sqlite/database.h"
#include "server/store/store.h"

namespace lightmill::sqlite {

/// All jobs with their nodes and results, and all small rows, but the epoch, the secret, and the values of ended jobs'
/// nodes; within the caller's transaction. Damaged rows are logged; jobs are left out, and nodes are removed. `repairs`
/// are to be applied in the same transaction. Tells `specs` which specifications are stored.
Result<StoredState> load_state(Database& database, stored::StoredSpecs& specs, std::vector<StoreOp>& repairs);

/// As Store::read_film.
Result<FilmPiece> read_film(Database& database, JobId job, const FilmPlace& after);

/// Which small rows there are.
Result<stored::RowKeys> load_keys(Database& database);

}  // namespace lightmill::sqlite
