// Formats of stores: the check of a version, and the migration to the current one.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/status.h"
#include "server/domain/stored_rows.h"
#include "server/store/store.h"

namespace lightmill {

/// FAILED_PRECONDITION unless `found`, the format of the store at `place`, is `known`. The message says what to do.
/// `elsewhere` is the alternative, such as "another folder with --data".
Status check_store_format(std::string_view place, std::int64_t found, std::int64_t known, std::string_view elsewhere);

/// Writes `state` to a store without jobs, some MiB per commit. The databases copy epoch, secret and next job id
/// themselves.
Status write_state(const StoredState& state, Store& store);

}  // namespace lightmill
