// From rows to the state that a coordinator starts with.
#pragma once

#include "server/store/sqlite/database.h"
#include "server/store/store.h"

namespace lightmill::sqlite {

/// All jobs with their settings and nodes, and the next epoch, which is counted on; within the caller's transaction.
/// What its checksum does not fit is logged; nodes and results are removed, jobs left out. `repairs` are to be applied
/// in the same transaction. DATA_LOSS for other rows that mean nothing.
Result<StoredState> load_state(Database& database, std::vector<StoreOp>& repairs);

}  // namespace lightmill::sqlite
