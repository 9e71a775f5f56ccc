// The one row that says which store this is and how far it has come.
#pragma once

#include <array>
#include <optional>

#include "common/base/digest.h"
#include "server/store/records.h"
#include "server/store/sqlite/database.h"

namespace lightmill::sqlite {

struct StoreRow {
  std::array<std::uint8_t, 16> id{};
  Sha256 secret;
  std::uint64_t epoch = 0;
  std::uint64_t commits = 0;
  Hash128 hash;  ///< XXH3-128 of the hash before and of the commit's writes
  stored::RowKeys::Sums keys{};
};

/// What a new store begins with, where it follows another one.
struct Beginning {
  std::optional<Sha256> secret = {};  ///< a random one without it
  std::uint64_t epoch = 0;            ///< the last one
  std::uint64_t highest_job = 0;      ///< the last id that was given
};

/// Writes the first one, with a random id; and the highest id among jobs.
Status create_store_row(Database& database, const Beginning& first);
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
