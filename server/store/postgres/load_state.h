// Loader of the coordinator's state from a PostgreSQL store.
#pragma once

#include "server/store/postgres/session.h"
#include "server/store/records.h"
#include "server/store/store.h"

namespace lightmill::postgres {

/// Reads all but the epoch and the values of ended jobs' nodes. Damaged rows are logged and left out. The caller
/// commits `repairs`. `specs` learns which specifications are stored. Nothing else may write meanwhile. Memory: the
/// state, and some MiB of rows at a time.
Result<StoredState> load_state(Session& session, stored::StoredSpecs& specs, std::vector<StoreOp>& repairs);

/// Implements Store::read_film().
Result<FilmPiece> read_film(Session& session, JobId job, const FilmPosition& after);

}  // namespace lightmill::postgres
