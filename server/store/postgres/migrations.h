// Migrations of a database from earlier formats. Each keeps the old tables. Nothing else may use the database
// meanwhile. Each needs a session that prepares no statements, and whose time limit allows a copy of all pixels.
#pragma once

#include "server/store/postgres/session.h"

namespace lightmill::postgres {

inline constexpr int kOldestFormat = 6;
/// Since this format, all rows but the summary are the same.
inline constexpr int kSameRowsFormat = 7;

/// Creates the schema `lightmill` again in one transaction, and keeps the old one as `lightmill_format_N`. `format` is
/// one of those from kOldestFormat on. FAILED_PRECONDITION if a coordinator uses the database, or it has lost rows.
/// DATA_LOSS if it is damaged otherwise.
Status migrate(Session& session, int format);

}  // namespace lightmill::postgres
