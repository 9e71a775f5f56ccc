// The row `summary`: what the last commit left. It shows damage that no single row shows.
#pragma once

#include <cstdint>

#include "server/store/postgres/session.h"
#include "server/store/records.h"

namespace lightmill::postgres {

struct Summary {
  std::uint64_t epoch = 0, commits = 0, highest_job = 0;  ///< as `turn` had them after the commit
  stored::RowKeys::Sums keys{};                           ///< of all small rows
};

std::int64_t checksum_of(const Summary& summary);

/// DATA_LOSS if the row is missing or damaged.
Result<Summary> read_summary(Session& session);

/// DATA_LOSS unless `turn`, `lease`, `audit_secret` and `summary` have one row each, and `turn` agrees with the
/// summary. The summary does not know an epoch without commits.
Status check_turn(Session& session);

/// Creates the row from `turn`.
Status create_summary(Session& session, const stored::RowKeys::Sums& keys);

}  // namespace lightmill::postgres
