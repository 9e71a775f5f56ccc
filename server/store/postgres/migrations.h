// Migrations of a database from the formats before. Nothing else may use it. Each needs a session that prepares no
// statements, and whose time limit allows a copy of all pixels.
#pragma once

#include "server/store/postgres/session.h"

namespace lightmill::postgres {

inline constexpr int kFormatBefore = 6;
inline constexpr int kFormat7 = 7;

/// Creates the schema `lightmill` again in one transaction, and keeps the old one as `lightmill_format_6`.
/// FAILED_PRECONDITION if a coordinator uses the database.
Status migrate_from_format_6(Session& session);

/// Adds the table `summary`, the only one that format 7 lacks, in one transaction. FAILED_PRECONDITION if a coordinator
/// uses the database.
Status upgrade_from_format_7(Session& session);

}  // namespace lightmill::postgres
