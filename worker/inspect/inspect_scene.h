// What scene files hold that somebody has handed over: the scene, ready to be submitted, and what people should know.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "common/base/status.h"
#include "common/farm/inspection.h"
#include "worker/assets/asset_cache.h"
#include "worker/render/scene_limits.h"

namespace lightmill {

struct InspectionHands {
  AssetFetch fetch;
  /// Asked before every file and every longer step; an error ends the inspection.
  using GoOn = std::function<Status()>;
  GoOn go_on;
  /// Brings those assets that the farm lacks.
  using Upload = std::function<Status(const std::map<Sha256, std::string>& assets, const GoOn& go_on)>;
  Upload upload;
};

/// Reads nothing but the files of the request. INVALID_ARGUMENT for what is wrong with them, RESOURCE_EXHAUSTED for
/// what is beyond `limits`, else the errors of the hands.
Result<Inspection> inspect_scene(const InspectionRequest& request, const SceneLimits& limits, DecoderProcess& images,
                                 const InspectionHands& hands);

}  // namespace lightmill
