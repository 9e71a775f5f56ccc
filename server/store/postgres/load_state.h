// Reads all of a coordinator's state from the database.
#pragma once

#include <vector>

#include "server/domain/effects.h"
#include "server/store/postgres/session.h"

namespace lightmill::postgres {

struct LoadedState {
  StoredState state;             ///< the epoch apart
  std::vector<StoreOp> damaged;  ///< drops of the nodes that were left out because they are damaged
};

/// Nobody else may write meanwhile. Memory: the state, and some MiB of rows at a time.
Result<LoadedState> load_state(Session& session);

}  // namespace lightmill::postgres
