// The statements of a commit, and what each write becomes.
#pragma once

#include <span>

#include "server/store/postgres/session.h"
#include "server/store/records.h"

namespace lightmill::postgres {

/// For Session: prepared once a connection.
std::span<const char* const> commit_statements();

/// Stores `ops` as the transaction `number` of the epoch. ALREADY_EXISTS with kStoredAlready if that one is stored.
Status send_commit(Session& session, std::uint64_t epoch, std::uint64_t number, std::span<const StoreOp> ops,
                   stored::StoredSpecs& specs);

/// Stores `ops` within the caller's transaction, statement by statement, on tables that may be new.
Status send_writes(Session& session, std::span<const StoreOp> ops, stored::StoredSpecs& specs);

}  // namespace lightmill::postgres
