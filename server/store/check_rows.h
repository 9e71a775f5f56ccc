// Whether what was read from a store can be a farm's state.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "server/domain/effects.h"

namespace lightmill {

/// Takes out, and says in the log, what no coordinator has written though its checksums fit. `repairs` are to be
/// committed. DATA_LOSS where nothing can be gone on from.
///
/// - Jobs without pixels, with times that are none, or done without a limit that ended them (`damaged_jobs`).
/// - Nodes of tiles that the film does not have, nodes that share samples, and nodes that have a sample without a
///   recorded result, or with several (`damaged`).
/// - Results of tiles that the film does not have.
Status take_out_nonsense(StoredState& state, std::vector<StoreOp>& repairs);

/// Adds samples that results record and no node has to `damaged`, and says so in the log: a node is gone. The
/// coordinator forgets these results, and has the samples rendered again. After take_out_nonsense.
void name_lost_nodes(StoredState& state);

}  // namespace lightmill
