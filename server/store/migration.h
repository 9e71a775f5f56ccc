// The step from one store format to the next: everything is read as it was and written as it is now.
#pragma once

#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/store/store.h"

namespace lightmill {

/// Writes what `state` holds into a store without jobs, some MiB a commit. Epoch, secret and next job id are the
/// database's own to bring along.
Status write_state(const StoredState& state, Store& store);

}  // namespace lightmill
