// Writes that later writes of the same transaction undo need not be written.
#pragma once

#include <vector>

#include "server/domain/effects.h"

namespace lightmill {

/// `ops` without nodes that are put and dropped again, and without job rows that are replaced later: applied in one
/// transaction to a store, it leaves what `ops` would leave. Order is kept.
std::vector<StoreOp> coalesce(std::vector<StoreOp> ops);

}  // namespace lightmill
