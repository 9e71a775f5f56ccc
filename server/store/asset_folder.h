// Asset store in a folder. The path of an asset is its digest: assets/ab/cdef….
#pragma once

#include <filesystem>
#include <memory>

#include "server/store/asset_store.h"

namespace lightmill {

/// Creates the folder if it does not exist. Removes the rest of interrupted uploads.
Result<std::unique_ptr<AssetStore>> open_asset_folder(std::filesystem::path folder, AssetLimits limits);

}  // namespace lightmill
