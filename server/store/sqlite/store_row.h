// The row that identifies a store and has its epoch, commits, running hash and sums.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "common/base/digest.h"
#include "server/store/sqlite/database.h"

namespace lightmill::sqlite {

struct StoreRow {
  std::array<std::uint8_t, 16> id{};
  Sha256 secret;
  std::uint64_t epoch = 0;
  std::uint64_t commits = 0;
  Hash128 hash;      ///< XXH3-128 of the previous hash and the commit's writes
  std::string sums;  ///< bytes of stored::RowSums; in formats before 15 another sum, over keys
};

/// First values of a new store that continues another one.
struct Beginning {
  std::optional<Sha256> secret = {};  ///< random if empty
  std::uint64_t epoch = 0;            ///< the last one in use
  std::uint64_t highest_job = 0;      ///< the last id in use
};

/// Writes the first row with a random store id, and sets the highest job id.
Status create_store_row(Database& database, const Beginning& first);
/// Of any format from 13 on. DATA_LOSS if the row is damaged.
Result<StoreRow> read_store_row(Database& database);

/// Replaces the row.
class StoreRowWriter {
 public:
  static Result<StoreRowWriter> prepare(Database& database);
  Status write(const StoreRow& row);

 private:
  Statement update_;
};

}  // namespace lightmill::sqlite
