// Brings a database of format 6, the one before this, to this format.
#pragma once

#include "server/store/postgres/session.h"

namespace lightmill::postgres {

inline constexpr int kFormatBefore = 6;

/// Makes the schema `lightmill` anew, in one transaction; the one before is kept as `lightmill_format_6`. Nobody else
/// may use the database. `session` prepares no statements, and has the patience that copying all pixels takes.
Status migrate_from_format_6(Session& session);

}  // namespace lightmill::postgres
