// Whether what was read from a store can be a farm's state.
#pragma once

#include "common/base/status.h"
#include "server/domain/effects.h"

namespace lightmill {

/// DATA_LOSS, naming the job, where rows say what no coordinator has written: a film without pixels, a node of a tile
/// that the film does not have, samples that stand twice. What nodes hold, their checksums show before.
Status check_stored(const StoredState& state);

}  // namespace lightmill
