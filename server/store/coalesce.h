// Removal of writes that a later write of the same transaction makes void.
#pragma once

#include <vector>

#include "server/domain/stored_rows.h"

namespace lightmill {

/// Returns `ops` without nodes that are put and dropped again, and without job rows that are replaced later. The stored
/// result of the transaction is the same. The order stays.
std::vector<StoreOp> coalesce(std::vector<StoreOp> ops);

}  // namespace lightmill
