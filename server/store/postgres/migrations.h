// Migrations of a database from the formats before. Each keeps the old tables. Nothing else may use it. Each needs a
// session that prepares no statements, and whose time limit allows a copy of all pixels.
#pragma once

#include "server/store/postgres/session.h"

namespace lightmill::postgres {

inline constexpr int kFormatBefore = 6;
inline constexpr int kFormat7 = 7;

/// Creates the schema `lightmill` again in one transaction, and keeps the old one as `lightmill_format_N`. `format` is
/// one of the two above. FAILED_PRECONDITION if a coordinator uses the database.
Status migrate(Session& session, int format);

}  // namespace lightmill::postgres
