// Reads all of a coordinator's state from the database.
#pragma once

#include "server/domain/effects.h"
#include "server/store/postgres/session.h"

namespace lightmill::postgres {

/// All but the epoch. What its checksum does not fit is logged and left out; `repairs` are to be committed. Nobody else
/// may write meanwhile. Memory: the state, and some MiB of rows at a time.
Result<StoredState> load_state(Session& session, std::vector<StoreOp>& repairs);

}  // namespace lightmill::postgres
