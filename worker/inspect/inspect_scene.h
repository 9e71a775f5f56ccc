// Inspection of uploaded scene files: makes a scene that can be submitted, and notices for its author.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "common/base/status.h"
#include "common/farm/inspection.h"
#include "worker/assets/asset_cache.h"
#include "worker/render/scene_limits.h"

namespace lightmill {

struct InspectionHooks {
  AssetFetch fetch;
  /// Uploads the assets that the farm lacks.
  std::function<Status(const std::map<Sha256, std::string>& assets)> upload;
};

/// Reads only the files of the request. INVALID_ARGUMENT if they are wrong, RESOURCE_EXHAUSTED if they exceed `limits`,
/// FAILED_PRECONDITION if this worker cannot decode their images or meshes. Otherwise the errors of `hooks`. Its time and
/// memory depend on the files, so it runs in a scene reader (scene_reader.h).
Result<Inspection> inspect_scene(const InspectionRequest& request, const SceneLimits& limits, DecoderProcess& images,
                                 const InspectionHooks& hooks);

}  // namespace lightmill
