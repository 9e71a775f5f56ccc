// From rows to the state that a coordinator starts with.
#pragma once

#include "server/store/row_values.h"
#include "server/store/sqlite/database.h"
#include "server/store/store.h"

namespace lightmill::sqlite {

/// Appends the jobs with their settings to `state.jobs`, as their rows have them; within the caller's transaction.
/// Tells `check` each job's stored checksum and which rows mean nothing; the caller finishes it.
Status read_jobs(Database& database, StoredState& state, stored::JobCheck& check);

/// All jobs with their settings and nodes, and the next epoch, which is counted on; within the caller's transaction.
/// What its checksum does not fit is logged; nodes and results are removed, jobs left out. `repairs` are to be applied
/// in the same transaction. DATA_LOSS for other rows that mean nothing.
Result<StoredState> load_state(Database& database, std::vector<StoreOp>& repairs);

}  // namespace lightmill::sqlite
