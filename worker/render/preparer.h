// Makes jobs ready to be rendered, on a thread of its own: scene document → assets → compiled scene → method.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <thread>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "common/farm/messages.h"
#include "common/methods/method.h"
#include "worker/assets/asset_cache.h"
#include "worker/render/scene_cache.h"

namespace lightmill {

/// What rendering a job's tiles takes. Immutable, shared by threads.
struct PreparedJob {
  TileGrid grid;
  std::shared_ptr<const Method> method;
};

/// Jobs are prepared one after the other; `done` is called from the preparer's thread.
class Preparer {
 public:
  using Done = std::function<void(std::shared_ptr<const JobDescription>, Result<PreparedJob>)>;
  Preparer(AssetCache& assets, SceneCacheLimits limits, Done done);
  /// Ends after the job under way; what waits is dropped.
  ~Preparer();

  void add(std::shared_ptr<const JobDescription> description);

 private:
  void run();
  Result<PreparedJob> prepare(const JobDescription& description);
  Result<std::shared_ptr<const CompiledScene>> compiled(const RenderSettings& settings);

  AssetCache& assets_;
  SceneCache scenes_;  // the thread's own
  const Done done_;
  Mutex mutex_;
  CondVar changed_;
  std::deque<std::shared_ptr<const JobDescription>> waiting_ LM_GUARDED_BY(mutex_);
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill
