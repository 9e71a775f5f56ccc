// Assets in the database, in pieces of at most 1 MiB.
#pragma once

#include <memory>

#include "server/store/asset_store.h"
#include "server/store/postgres/leadership.h"

namespace lightmill::postgres {

/// Removes what interrupted uploads left. What assets there are is known from then on without asking: nobody else adds
/// or removes any within the epoch.
Result<std::unique_ptr<AssetStore>> open_postgres_assets(std::shared_ptr<Leadership> leadership, AssetLimits limits);

}  // namespace lightmill::postgres
