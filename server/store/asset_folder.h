// Assets on disk, named by their content: assets/ab/cdef….
#pragma once

#include <filesystem>
#include <memory>

#include "server/store/asset_store.h"

namespace lightmill {

/// Creates the folder if need be, and removes what interrupted uploads left.
Result<std::unique_ptr<AssetStore>> open_asset_folder(std::filesystem::path folder, AssetLimits limits);

}  // namespace lightmill
