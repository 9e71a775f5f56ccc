#include "server/store/row_statements.h"

#include <fmt/format.h>

#include "server/store/row_values.h"

namespace lightmill::stored {
namespace {

constexpr std::string_view kPlace = "job = $1 AND tile = $2 AND level = $3 AND range_index = $4";
/// Columns that count_row() reads.
constexpr std::string_view kNode = "job, tile, level, range_index, hash",
                           kResult = "job, tile, level, range_index, checksum";

std::string put_record(Table table) {
  const TableInfo& info = info_of(table);
  const std::string again = table == Table::actions  // these never change
                                ? fmt::format("NOTHING RETURNING {}, checksum", info.key)
                                : "UPDATE SET message = $2, checksum = $3";
  return fmt::format("INSERT INTO {} VALUES ($1, $2, $3) ON CONFLICT ({}) DO {}", info.name, info.key, again);
}

}  // namespace

std::array<std::string, kRowStatementCount> row_statements(std::string_view within) {
  std::array<std::string, kRowStatementCount> sql;
  sql[kFindNode] = fmt::format("SELECT {} FROM nodes WHERE {}", kNode, kPlace);
  sql[kPutNode] =
      "INSERT INTO nodes (job, tile, level, range_index, non_finite, hash, samples) "
      "VALUES ($1, $2, $3, $4, $5, $6, $7) "
      "ON CONFLICT (job, tile, level, range_index) DO UPDATE SET non_finite = $5, hash = $6, samples = $7";
  sql[kDropNode] = fmt::format("DELETE FROM nodes WHERE {}", kPlace);
  sql[kFindNodesOf] = fmt::format("SELECT {} FROM nodes WHERE job = $1", kNode);
  sql[kFindResult] = fmt::format("SELECT {} FROM results WHERE {}", kResult, kPlace);
  sql[kPutResult] =
      "INSERT INTO results VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10) "
      "ON CONFLICT (job, tile, level, range_index) "
      "DO UPDATE SET hash = $5, worker = $6, machine = $7, audit = $8, fingerprint_class = $9, checksum = $10";
  sql[kPutAudited] =
      fmt::format("UPDATE results SET audit = 2, checksum = (checksum & ~CAST(3 AS BIGINT)) | 2 WHERE {} RETURNING {}",
                  kPlace, kResult);
  sql[kDropResults] = fmt::format("DELETE FROM results WHERE {} RETURNING {}", within, kResult);
  sql[kDropResultRow] = fmt::format("DELETE FROM results WHERE {} RETURNING {}", kPlace, kResult);
  sql[kFindResultsOf] = fmt::format("SELECT {} FROM results WHERE job = $1", kResult);
  for (std::size_t i = 0; i < kTableCount; ++i) {
    const TableInfo& info = kTables[i];
    sql[kFindRecord + i] = fmt::format("SELECT {0}, checksum FROM {1} WHERE {0} = $1", info.key, info.name);
    sql[kPutRecord + i] = put_record(static_cast<Table>(i));
    sql[kDropRecord + i] = fmt::format("DELETE FROM {1} WHERE {0} = $1 RETURNING {0}, checksum", info.key, info.name);
  }
  return sql;
}

void count_row(int statement, const Row& row, RowSums& sums) {
  const bool there = statement == kPutAudited || (statement >= kPutRecord && statement < kDropRecord);
  if (statement >= kFindRecord) {
    const int table = (statement - kFindRecord) % static_cast<int>(kTableCount);
    sums.count(static_cast<Table>(table), key_in(row, kTables[static_cast<std::size_t>(table)]), row.integer(1), there);
    return;
  }
  const JobId job{row.natural(0)};
  const FilmPosition place = place_in(row, 1);
  if (statement <= kFindNodesOf) {
    sums.count_node(job, place, row.view(4), there);
  } else {
    sums.count_result(job, place, row.integer(4), there);
  }
}

}  // namespace lightmill::stored
