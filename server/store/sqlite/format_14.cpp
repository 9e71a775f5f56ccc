#include "server/store/sqlite/format_14.h"

#include "server/store/load_state.h"
#include "server/store/sqlite/sqlite_store.h"

namespace lightmill::sqlite {

Status convert_format_14(Database& database, StoreRow& row) {
  LM_RETURN_IF_ERROR(database.execute("BEGIN IMMEDIATE; ALTER TABLE store RENAME COLUMN keys TO sums"));
  LM_ASSIGN_OR_RETURN(const stored::RowSums sums, stored::load_sums(database));
  row.sums = sums.bytes();
  LM_ASSIGN_OR_RETURN(StoreRowWriter writer, StoreRowWriter::prepare(database));
  LM_RETURN_IF_ERROR(writer.write(row));
  return database.execute(fmt::format("PRAGMA user_version = {}; COMMIT", kSqliteFormatVersion));
}

}  // namespace lightmill::sqlite
