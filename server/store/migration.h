// Migration to the current store format: reads the old format and writes the new one.
#pragma once

#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/store/store.h"

namespace lightmill {

/// Writes `state` to a store without jobs, some MiB per commit. The databases copy epoch, secret and next job id
/// themselves.
Status write_state(const StoredState& state, Store& store);

}  // namespace lightmill
