// SQL statements that write rows, for all databases.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "server/store/records.h"
#include "server/store/row_source.h"
#include "server/store/row_sums.h"

namespace lightmill::stored {

/// A statement that finds rows comes before one that replaces or deletes them. Statements that delete small rows or
/// results return them. Those of nodes do not, because SQLite would read their values.
enum RowStatement : int {
  kFindNode,       ///< job, tile, level, range_index
  kPutNode,        ///< job, tile, level, range_index, non_finite, hash, samples
  kDropNode,       ///< job, tile, level, range_index
  kFindNodesOf,    ///< job
  kFindResult,     ///< job, tile, level, range_index
  kPutResult,      ///< the columns of `results`
  kPutAudited,     ///< job, tile, level, range_index. Returns the row
  kDropResults,    ///< the same: all results whose samples lie in this range
  kDropResultRow,  ///< job, tile, level, range_index
  kFindResultsOf,  ///< job
  kFindRecord,     ///< the first of one per table (Table): key
  /// The first of one per table: key, message, checksum. That of the log returns the row, unless the key is in use.
  kPutRecord = kFindRecord + static_cast<int>(kTableCount),
  kDropRecord = kPutRecord + static_cast<int>(kTableCount),  ///< the first of one per table: key
  kRowStatementCount = kDropRecord + static_cast<int>(kTableCount)
};

/// SQL of the statements, with the parameters $1, $2, …, which first occur in this order. `within`: the database's
/// condition of kDropResults.
std::array<std::string, kRowStatementCount> row_statements(std::string_view within);

/// Counts a row that a statement returned: rows that are found or deleted are removed from the sums.
void count_row(int statement, const Row& row, RowSums& sums);

}  // namespace lightmill::stored
