// Checks of the loaded state: whether a coordinator can have written it.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "server/domain/stored_rows.h"

namespace lightmill {

/// Removes and logs rows that no coordinator can have written, although their checksums match. The caller commits
/// `repairs`. DATA_LOSS if no consistent state remains.
/// - `damaged_jobs`: jobs without pixels, with impossible times, or done although no limit was reached.
/// - `damaged`: nodes of tiles that the film does not have; nodes that share samples; nodes with a sample that has no
///   recorded result, or several.
/// - Results of tiles that the film does not have.
Status remove_invalid_rows(StoredState& state, std::vector<StoreOp>& repairs);

/// Adds samples to `damaged` that have a recorded result but no node, and logs them: a node is lost. The coordinator
/// drops these results, and has the samples rendered again. Call it after remove_invalid_rows().
void report_lost_nodes(StoredState& state);

}  // namespace lightmill
