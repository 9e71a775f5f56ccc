// Statements of a commit, and their parameters for each write.
#pragma once

#include <span>

#include "server/store/postgres/session.h"
#include "server/store/postgres/summary.h"
#include "server/store/records.h"

namespace lightmill::postgres {

/// Statements that a Session prepares for each connection.
std::span<const char* const> commit_statements();

/// Stores `ops` as the transaction with the number, epoch and highest job of `after`, and updates its sums.
/// ALREADY_EXISTS with kStoredAlready if that transaction is stored.
Status send_commit(Session& session, Summary& after, std::span<const StoreOp> ops, stored::StoredSpecs& specs);

/// Stores `ops` in the caller's transaction, one statement at a time. The tables may be new, so nothing is prepared.
/// Writes neither `current_epoch` nor `summary`, whose sums the caller computes from the rows.
Status send_writes(Session& session, std::span<const StoreOp> ops, stored::StoredSpecs& specs);

}  // namespace lightmill::postgres
