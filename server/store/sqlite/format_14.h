// Step from formats 13 and 14. They have the rows of this format, and no sums over them.
#pragma once

#include "server/store/sqlite/database.h"
#include "server/store/sqlite/store_row.h"

namespace lightmill::sqlite {

/// Adds the sums over rows, and marks the database with this program's format, in one transaction.
Status convert_format_14(Database& database, StoreRow& row);

}  // namespace lightmill::sqlite
