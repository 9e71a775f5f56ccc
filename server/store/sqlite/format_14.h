// Conversion of an SQLite store from format 13 or 14 to the current format. The rows stay; sums over them are added.
#pragma once

#include "server/store/sqlite/database.h"
#include "server/store/sqlite/store_row.h"

namespace lightmill::sqlite {

/// Adds the sums over rows, and marks the database with this program's format, in one transaction.
Status convert_format_14(Database& database, StoreRow& row);

}  // namespace lightmill::sqlite
