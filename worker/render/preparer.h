// Makes jobs ready to be rendered, on a thread of its own: scene document → assets → compiled scene → method; and runs
// the pilots that choose methods and allocate samples.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <thread>
#include <variant>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "common/farm/messages.h"
#include "common/methods/method.h"
#include "common/scene/compiled/compiled_scene.h"
#include "worker/assets/asset_cache.h"
#include "worker/render/scene_cache.h"
#include "worker/render/scene_limits.h"

namespace lightmill {

/// What rendering a job's tiles takes. Immutable, shared by threads.
struct PreparedJob {
  TileGrid grid;
  std::shared_ptr<const Method> method;
};

/// Jobs and pilots are taken one after the other; `done` and `pilot_done` are called from the preparer's thread, for
/// each that is not dropped.
class Preparer {
 public:
  using Done = std::function<void(std::shared_ptr<const JobDescription>, Result<PreparedJob>)>;
  using PilotDone = std::function<void(LeaseId, Result<PilotReport>)>;
  Preparer(AssetCache& assets, SceneCacheLimits kept, const SceneLimits& limits, const DecoderOptions& decoder,
           Done done, PilotDone pilot_done);
  /// Ends after the scene, or the pilot's patch, that is under way; the rest is dropped.
  ~Preparer();

  /// Instead of what still waits for the same job.
  void add(std::shared_ptr<const JobDescription> description);
  void add(std::shared_ptr<const PilotGrant> pilot);
  /// If it still waits.
  void drop(JobId job);
  /// Also while it is run.
  void drop(LeaseId pilot);
  /// Memory has ended elsewhere: compiled scenes and assets are not kept any longer.
  void drop_caches();

 private:
  struct DropCaches {};
  using Task = std::variant<std::shared_ptr<const JobDescription>, std::shared_ptr<const PilotGrant>, DropCaches>;
  void work();
  /// What `make` returns. If memory ends meanwhile, it is called once more without the caches.
  template <class Make>
  auto within_memory(const Make& make) -> decltype(make());
  void clear_caches();
  void enqueue(Task task);
  Result<PreparedJob> prepare(const JobDescription& description);
  Result<PilotReport> run(const PilotGrant& pilot, const std::stop_token& stop);
  Result<std::shared_ptr<const CompiledScene>> compiled(const RenderSettings& settings);

  AssetCache& assets_;
  const SceneLimits limits_;
  SceneCache scenes_;       // the thread's own
  DecoderProcess decoder_;  // likewise
  const Done done_;
  const PilotDone pilot_done_;
  Mutex mutex_;
  CondVar changed_;
  std::deque<Task> waiting_ LM_GUARDED_BY(mutex_);
  std::optional<LeaseId> running_pilot_ LM_GUARDED_BY(mutex_);
  std::stop_source stop_pilot_ LM_GUARDED_BY(mutex_);  ///< of the one that is run
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill
