// Reader of stores of format 12, the oldest format that can be converted.
#pragma once

#include "server/domain/stored_rows.h"
#include "server/store/sqlite/database.h"

namespace lightmill::sqlite {

inline constexpr int kOldestFormat = 12;

/// Reads everything, including the secret and the last epoch. Damaged rows are logged and left out. Changes nothing.
Result<StoredState> load_format_12(Database& database);

}  // namespace lightmill::sqlite
