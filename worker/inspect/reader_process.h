// The worker's side of a scene reader (scene_reader.h).
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "common/base/file.h"
#include "common/base/status.h"
#include "common/farm/inspection.h"
#include "worker/assets/asset_cache.h"
#include "worker/render/scene_limits.h"

namespace lightmill {

/// Transfers of a scene's assets to the farm. Both may take long.
struct AssetUploads {
  /// Those of the digests that the farm lacks.
  std::function<Result<std::vector<Sha256>>(std::span<const Sha256> digests)> missing;
  std::function<Status(const Sha256& digest, ByteView bytes)> upload;
};

struct ReaderHooks {
  AssetFetch fetch;
  AssetUploads uploads;
  /// Called often. An error ends the reader at once, and the inspection with this error.
  std::function<Status()> may_continue;
};

struct ReaderOptions {
  std::filesystem::path program = own_folder() / "lightmill-worker";
  DecoderOptions decoder = {};
  std::uint64_t cpu_seconds = 60;
};

/// Memory of a scene reader: what a worker with the default limits has beside the largest scene, and a little more.
std::uint64_t reader_memory(const SceneLimits& limits);

/// Reads the request's scene in a process of its own, which ends with this call. Errors are those of inspect_scene,
/// those of all hooks except `fetch`, and RESOURCE_EXHAUSTED, DEADLINE_EXCEEDED or INTERNAL if the process ends early.
Result<Inspection> inspect_in_reader(const InspectionRequest& request, const SceneLimits& limits,
                                     const ReaderOptions& options, const ReaderHooks& hooks);

}  // namespace lightmill
