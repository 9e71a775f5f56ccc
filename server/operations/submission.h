// Checks of the files of an inspection.
#pragma once

#include "common/farm/inspection.h"
#include "server/store/asset_store.h"

namespace lightmill {

/// Limit for the files of one inspection together. A worker has them in memory beside the scenes that it renders.
inline constexpr std::uint64_t kMostInspectedBytes = std::uint64_t{512} << 20;

/// FAILED_PRECONDITION if a file is missing, RESOURCE_EXHAUSTED if they have too many bytes. Blocks on the disk.
Status check_files(const InspectionRequest& request, const AssetStore& assets);

}  // namespace lightmill
