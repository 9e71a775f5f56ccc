// What is looked at before a job or a scene's files are taken in.
#pragma once

#include "common/farm/inspection.h"
#include "server/store/asset_store.h"

namespace lightmill {

/// What the files of one inspection may have together: a worker holds them beside the scenes that it renders.
inline constexpr std::uint64_t kMostInspectedBytes = std::uint64_t{512} << 20;

/// FAILED_PRECONDITION if a file is missing, RESOURCE_EXHAUSTED if they have too many bytes. Looks at the disk.
Status check_files(const InspectionRequest& request, const AssetStore& assets);

}  // namespace lightmill
