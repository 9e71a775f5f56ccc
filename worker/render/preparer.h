// Makes jobs ready to be rendered, on a thread of its own: scene document → assets → compiled scene → method; and runs
// the pilots that choose methods.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <thread>
#include <variant>

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

/// Jobs and pilots are taken one after the other; `done` and `pilot_done` are called from the preparer's thread.
class Preparer {
 public:
  using Done = std::function<void(std::shared_ptr<const JobDescription>, Result<PreparedJob>)>;
  using PilotDone = std::function<void(LeaseId, Result<PilotReport>)>;
  Preparer(AssetCache& assets, SceneCacheLimits limits, Done done, PilotDone pilot_done);
  /// Ends after what is under way; what waits is dropped.
  ~Preparer();

  using Task = std::variant<std::shared_ptr<const JobDescription>, std::shared_ptr<const PilotGrant>>;
  void add(Task task);

 private:
  void run();
  void take(std::shared_ptr<const JobDescription> description);
  void take(const std::shared_ptr<const PilotGrant>& pilot);
  Result<PreparedJob> prepare(const JobDescription& description);
  Result<PilotReport> run(const PilotGrant& pilot);
  Result<std::shared_ptr<const CompiledScene>> compiled(const RenderSettings& settings);

  AssetCache& assets_;
  SceneCache scenes_;  // the thread's own
  const Done done_;
  const PilotDone pilot_done_;
  Mutex mutex_;
  CondVar changed_;
  std::deque<Task> waiting_ LM_GUARDED_BY(mutex_);
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill
