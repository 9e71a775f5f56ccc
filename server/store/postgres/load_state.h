// Reads all of a coordinator's state from the database.
#pragma once

#include "server/store/postgres/session.h"
#include "server/store/records.h"
#include "server/store/store.h"

namespace lightmill::postgres {

/// All but the epoch, and the values of ended jobs' nodes. Damaged rows are logged and left out; `repairs` are to be
/// committed. Tells `specs` which specifications are stored. Nobody else may write meanwhile. Memory: the state, and
/// some MiB of rows at a time.
Result<StoredState> load_state(Session& session, stored::StoredSpecs& specs, std::vector<StoreOp>& repairs);

/// As Store::read_film.
Result<FilmPiece> read_film(Session& session, JobId job, const FilmPlace& after);

}  // namespace lightmill::postgres
