// From rows to the state that a coordinator starts with.
#pragma once

#include "server/store/sqlite/database.h"
#include "server/store/store.h"

namespace lightmill::sqlite {

/// All jobs with their settings and nodes, and the next epoch, which is counted on; within the caller's transaction.
/// Nodes whose checksum does not fit are logged and removed. DATA_LOSS for rows that mean nothing.
Result<StoredState> load_state(Database& database);

}  // namespace lightmill::sqlite
