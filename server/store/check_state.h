// Offline check of everything that a coordinator has stored.
#pragma once

#include <string>
#include <vector>

#include "server/store/asset_store.h"
#include "server/store/store.h"

namespace lightmill {

/// Size of an asset in bytes. DATA_LOSS if it differed from its digest, or bytes were missing: then it is logged and
/// deleted, unless a newer copy is in its place.
Result<std::uint64_t> check_asset(AssetStore& store, const Sha256& digest);

struct AssetCheck {
  std::uint64_t assets = 0, bytes = 0;  ///< sound assets
  std::vector<Sha256> damaged;          ///< deleted: their digest differed, or bytes were missing
};
/// Reads all assets. Nothing else may use the store meanwhile. If an asset cannot be read at all, it returns that error
/// and deletes no asset.
Result<AssetCheck> check_assets(AssetStore& store);

struct StateCheck {
  std::vector<std::string> report;  ///< lines for people
  bool sound = true;                ///< nothing is damaged
  bool whole = true;                ///< everything lost will be rendered again
  std::size_t missing_assets = 0;   ///< assets of jobs that are not stored
};
/// The last line for people. Empty if something is lost, because the error says so.
std::string conclusion_of(const StateCheck& check);

/// Reads everything in the store and removes what is damaged:
/// - Nodes, and nodes with a result of unknown origin. The next coordinator has their samples rendered again.
/// - Assets. Clients send them again with the next job that needs them.
/// - Jobs whose scene or settings are lost.
///
/// `store` is not loaded yet, and nothing else uses `store` or `assets`. DATA_LOSS if the database itself is damaged.
Result<StateCheck> check_state(Store& store, AssetStore& assets);

}  // namespace lightmill
