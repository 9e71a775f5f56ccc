// Check of a store's format version.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// FAILED_PRECONDITION unless `found`, the format of the store at `place`, is `known`. The message says what to do.
/// `elsewhere` is the alternative, such as "another directory with --data".
Status check_store_format(std::string_view place, std::int64_t found, std::int64_t known, std::string_view elsewhere);

}  // namespace lightmill
