// Compiled scenes that a worker keeps: its threads and its jobs share them.
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

/// Least recently used first to go; the newest always stays. A scene in use lives on with its users. Not thread-safe.
class SceneCache {
 public:
  explicit SceneCache(SceneCacheLimits limits) : limits_(limits) {}

  /// Null if it is not there.
  std::shared_ptr<const CompiledScene> find(const Sha256& key);
  void clear();
  void insert(const Sha256& key, std::shared_ptr<const CompiledScene> scene);

 private:
  struct Entry {
    Sha256 key;
    std::shared_ptr<const CompiledScene> scene;
  };
  SceneCacheLimits limits_;
  std::list<Entry> entries_;  ///< last used first
  std::uint64_t bytes_ = 0;
};

}  // namespace lightmill
