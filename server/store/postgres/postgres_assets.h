// Asset store in the database, in pieces of at most 1 MiB.
#pragma once

#include <memory>

#include "server/store/asset_store.h"
#include "server/store/postgres/leadership.h"

namespace lightmill::postgres {

/// Removes the rest of interrupted uploads. Afterwards it knows all assets without a query, because nothing else
/// changes them within the epoch.
Result<std::unique_ptr<AssetStore>> open_postgres_assets(std::shared_ptr<Leadership> leadership, AssetLimits limits);

}  // namespace lightmill::postgres
