// Step from format 7, which has all tables but `summary`.
#pragma once

#include "server/store/postgres/session.h"

namespace lightmill::postgres {

inline constexpr int kFormat7 = 7;

/// FAILED_PRECONDITION if a coordinator uses the database.
Status check_idle(Session& session);

/// Adds the table in one transaction. Nothing else may use the database. `session` prepares no statements.
Status upgrade_from_format_7(Session& session);

}  // namespace lightmill::postgres
