// The one row that says which store this is and how far it has come.
#pragma once

#include <array>

#include "common/base/digest.h"
#include "server/store/sqlite/database.h"

namespace lightmill::sqlite {

struct StoreRow {
  std::array<std::uint8_t, 16> id{};
  Sha256 secret;
  std::uint64_t epoch = 0;
  std::uint64_t commits = 0;
  Hash128 hash;  ///< XXH3-128 of the hash before and of the commit's writes
};

/// Writes the first one, with a random id and secret.
Status create_store_row(Database& database);
/// DATA_LOSS if it is damaged.
Result<StoreRow> read_store_row(Database& database);

/// Writes it anew.
class StoreRowWriter {
 public:
  static Result<StoreRowWriter> prepare(Database& database);
  Status write(const StoreRow& row);

 private:
  Statement update_;
};

}  // namespace lightmill::sqlite
