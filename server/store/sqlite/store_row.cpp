#include "server/store/sqlite/store_row.h"

#include <cstring>

#include "server/store/row_sums.h"
#include "server/store/row_values.h"

namespace lightmill::sqlite {
namespace {

std::int64_t checksum_of(const StoreRow& row) {
  Xxh3Hasher hasher;
  hasher.append(stored::view_of(row.id));
  hasher.append(stored::view_of(row.secret.bytes));
  const std::array<std::uint64_t, 4> numbers{row.epoch, row.commits, row.hash.high, row.hash.low};
  hasher.append(stored::view_of(numbers));
  hasher.append(as_byte_view(row.sums));
  return static_cast<std::int64_t>(hasher.finish().low);
}

Status damaged(std::string_view what) {
  return data_loss("the row that identifies the store is damaged: {}", what);
}

}  // namespace

Status create_store_row(Database& database, const Beginning& first) {
  StoreRow row;
  LM_ASSIGN_OR_RETURN(Statement drawn, database.prepare("SELECT randomblob(16), randomblob(32)"));
  LM_RETURN_IF_ERROR(drawn.step().status());
  std::memcpy(row.id.data(), drawn.view(0).data(), row.id.size());
  LM_ASSIGN_OR_RETURN(row.secret, stored::digest_in(drawn.view(1), "the secret"));
  drawn.reset();
  row.secret = first.secret.value_or(row.secret);
  row.epoch = first.epoch;
  row.sums = stored::RowSums().bytes();
  LM_ASSIGN_OR_RETURN(Statement insert, database.prepare("INSERT INTO store VALUES (?1, ?2, 0, 0, x'', x'', 0)"));
  insert.bind_all(stored::view_of(row.id), stored::view_of(row.secret.bytes));
  LM_RETURN_IF_ERROR(insert.run());
  LM_ASSIGN_OR_RETURN(Statement sequence, database.prepare("INSERT INTO sqlite_sequence VALUES ('jobs', ?1)"));
  sequence.bind_all(first.highest_job);
  LM_RETURN_IF_ERROR(sequence.run());
  LM_ASSIGN_OR_RETURN(StoreRowWriter writer, StoreRowWriter::prepare(database));
  return writer.write(row);
}

Result<StoreRow> read_store_row(Database& database) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT * FROM store"));
  LM_ASSIGN_OR_RETURN(const bool found, rows.step());
  StoreRow row;
  if (!found || rows.view(0).size() != row.id.size()) {
    return damaged(found ? "its id" : "it is missing");
  }
  std::memcpy(row.id.data(), rows.view(0).data(), row.id.size());
  LM_ASSIGN_OR_RETURN(row.secret, stored::digest_in(rows.view(1), "the secret"));
  row.epoch = rows.natural(2);
  row.commits = rows.natural(3);
  LM_ASSIGN_OR_RETURN(row.hash, stored::hash_in(rows.view(4)));
  row.sums = rows.text(5);
  return rows.integer(6) == checksum_of(row) ? Result<StoreRow>(row) : damaged("its checksum is wrong");
}

Result<StoreRowWriter> StoreRowWriter::prepare(Database& database) {
  StoreRowWriter writer;
  LM_ASSIGN_OR_RETURN(writer.update_, database.prepare("UPDATE store SET epoch = ?1, commits = ?2, hash = ?3, "
                                                       "sums = ?4, checksum = ?5"));
  return writer;
}

Status StoreRowWriter::write(const StoreRow& row) {
  const std::string hash = hash_bytes(row.hash);
  update_.bind_all(row.epoch, row.commits, as_byte_view(hash), as_byte_view(row.sums), checksum_of(row));
  return update_.run();
}

}  // namespace lightmill::sqlite
