// Whether what was read from a store can be a farm's state.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "server/domain/effects.h"

namespace lightmill {

/// Takes out, and says in the log, what no coordinator has written though its checksums fit: jobs without pixels or
/// with times that are none (`damaged_jobs`), nodes of tiles that the film does not have, that share samples, or of
/// which it is not known who rendered them (`damaged`), and such results. `repairs` are to be committed. DATA_LOSS
/// where nothing can be gone on from.
Status take_out_nonsense(StoredState& state, std::vector<StoreOp>& repairs);

}  // namespace lightmill
