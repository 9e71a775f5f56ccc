// Cache of a worker's compiled scenes, shared by its threads and jobs.
#pragma once

#include <cstdint>
#include <list>
#include <memory>

#include "common/base/digest.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

struct SceneCacheLimits {
  std::size_t scenes = 8;
  std::uint64_t bytes = std::uint64_t{4} << 30;
};

/// Drops the least recently used scene first, but never the newest. A dropped scene lives until its last user ends. Not
/// thread-safe.
class SceneCache {
 public:
  explicit SceneCache(SceneCacheLimits limits) : limits_(limits) {}

  /// Null if the scene is not cached.
  std::shared_ptr<const CompiledScene> find(const Sha256& key);
  void clear();
  void insert(const Sha256& key, std::shared_ptr<const CompiledScene> scene);

 private:
  struct Entry {
    Sha256 key;
    std::shared_ptr<const CompiledScene> scene;
  };
  SceneCacheLimits limits_;
  std::list<Entry> entries_;  ///< most recently used first
  std::uint64_t bytes_ = 0;
};

}  // namespace lightmill
