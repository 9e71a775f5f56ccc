// Reads a store of format 12, the one before this.
#pragma once

#include "server/domain/effects.h"
#include "server/store/sqlite/database.h"

namespace lightmill::sqlite {

inline constexpr int kFormatBefore = 12;

/// All of it, the secret and the last epoch too. What is damaged is logged and left out. Changes nothing.
Result<StoredState> load_format_12(Database& database);

}  // namespace lightmill::sqlite
