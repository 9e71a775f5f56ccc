// Migration of a database from format 6.
#pragma once

#include "server/store/postgres/session.h"

namespace lightmill::postgres {

inline constexpr int kFormatBefore = 6;

/// Creates the schema `lightmill` again in one transaction, and keeps the old one as `lightmill_format_6`. Nothing else
/// may use the database. `session` prepares no statements; its time limit must allow a copy of all pixels.
Status migrate_from_format_6(Session& session);

}  // namespace lightmill::postgres
