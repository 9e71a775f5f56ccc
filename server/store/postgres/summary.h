// The row `summary`: what the last commit left. It shows damage that no single row shows.
#pragma once

#include <cstdint>

#include "server/store/postgres/session.h"
#include "server/store/row_sums.h"

namespace lightmill::postgres {

struct Summary {
  std::uint64_t epoch = 0, commits = 0, highest_job = 0;  ///< as in `current_epoch` after the commit
  stored::RowSums sums;                                   ///< over all rows
};

std::int64_t checksum_of(const Summary& summary);

/// DATA_LOSS if the row is missing or damaged.
Result<Summary> read_summary(Session& session);

/// DATA_LOSS unless `current_epoch`, `lease`, `audit_secret` and `summary` have one row each, and `current_epoch`
/// agrees with the summary. The summary does not know an epoch without commits. In earlier formats, the table has
/// another name.
Status check_current_epoch(Session& session, std::string_view table = "current_epoch");

/// Creates the row from `current_epoch`.
Status create_summary(Session& session, const stored::RowSums& sums);

}  // namespace lightmill::postgres
