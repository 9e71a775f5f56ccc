// Check of the pages of an SQLite file.
#pragma once

#include "server/store/sqlite/database.h"

namespace lightmill::sqlite {

/// Reads all pages. DATA_LOSS names the tables whose pages are damaged, and the jobs whose rows cannot be read.
Status check_structure(Database& database);

}  // namespace lightmill::sqlite
