// Looks through all that a coordinator has stored.
#pragma once

#include <string>
#include <vector>

#include "server/store/asset_store.h"
#include "server/store/store.h"

namespace lightmill {

struct AssetCheck {
  std::uint64_t assets = 0, bytes = 0;  ///< that are as they should be
  std::vector<Sha256> damaged;  ///< whose bytes had another digest, or were not all there: they are forgotten now
};
/// Reads all assets. Nobody else may use the store meanwhile. The error of one that cannot be read now: none is
/// forgotten then.
Result<AssetCheck> check_assets(AssetStore& store);

struct StateCheck {
  std::vector<std::string> report;  ///< lines for people
  bool sound = true;                ///< nothing was damaged
  bool whole = true;                ///< nor is anything lost that is not rendered again by itself
};
/// Reads everything that is stored and takes out what is damaged: nodes, and those that results went into of which it
/// cannot be told any more who rendered them: their samples are rendered again once a coordinator starts; assets, which
/// clients send again with the next job that has them; and whole jobs where what they render is not known any more.
/// `store` has not been loaded yet; nobody else uses either. DATA_LOSS if the database itself is damaged.
Result<StateCheck> check_state(Store& store, AssetStore& assets);

}  // namespace lightmill
