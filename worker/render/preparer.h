// Thread that prepares jobs (scene document → assets → compiled scene → method) and runs the pilots that choose methods
// and allocate samples.
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
#include "worker/render/render_pool.h"
#include "worker/render/scene_cache.h"
#include "worker/render/scene_limits.h"

namespace lightmill {

/// Inputs of the threads that render a job's tiles. Immutable and shared.
struct PreparedJob {
  TileGrid grid;
  std::shared_ptr<const Method> method;
};

/// Runs one job or pilot at a time. Its thread calls `done` and `pilot_done` for each one that is not dropped.
class Preparer {
 public:
  using Done = std::function<void(std::shared_ptr<const JobDescription>, Result<PreparedJob>)>;
  using PilotDone = std::function<void(LeaseId, Result<PilotReport>)>;
  Preparer(AssetCache& assets, SceneCacheLimits kept, const SceneLimits& limits, const DecoderOptions& decoder,
           Done done, PilotDone pilot_done);
  /// Ends after the current scene or pilot patch, and drops the rest.
  ~Preparer();

  /// Replaces a waiting task of the same job.
  void add(std::shared_ptr<const JobDescription> description);
  void add(std::shared_ptr<const PilotGrant> pilot);
  /// Drops the job if it still waits. If its preparation runs, that ends as soon as another task waits.
  void drop(JobId job);
  /// Drops the pilot, even while it runs.
  void drop(LeaseId pilot);
  /// The running pilot, and the CPU seconds of its thread. Nothing if none runs.
  std::optional<std::pair<LeaseId, double>> pilot_at_work() const;
  /// Frees cached scenes and assets, because another thread has run out of memory.
  void drop_caches();

 private:
  struct DropCaches {};
  using Task = std::variant<std::shared_ptr<const JobDescription>, std::shared_ptr<const PilotGrant>, DropCaches>;
  void work();
  /// Returns the result of `make`. If it runs out of memory, calls it once more without the caches.
  template <class Make>
  auto within_memory(const Make& make) -> decltype(make());
  void clear_caches();
  void enqueue(Task task);
  void remove_waiting(JobId job) LM_REQUIRES(mutex_);
  void stop_if_unwanted() LM_REQUIRES(mutex_);
  Result<PreparedJob> prepare(const JobDescription& description, const std::stop_token& stop);
  Result<PilotReport> run(const PilotGrant& pilot, const std::stop_token& stop);
  Result<std::shared_ptr<const CompiledScene>> compiled(const RenderSettings& settings, const std::stop_token& stop);

  AssetCache& assets_;
  const SceneLimits limits_;
  SceneCache scenes_;       // used by the thread only
  DecoderProcess decoder_;  // used by the thread only
  const Done done_;
  const PilotDone pilot_done_;
  mutable Mutex mutex_;
  CondVar changed_;
  std::deque<Task> waiting_ LM_GUARDED_BY(mutex_);
  std::optional<LeaseId> running_pilot_ LM_GUARDED_BY(mutex_);
  std::optional<CpuClock> pilot_cpu_ LM_GUARDED_BY(mutex_);  ///< while a pilot runs
  std::optional<JobId> running_job_ LM_GUARDED_BY(mutex_);
  bool unwanted_ LM_GUARDED_BY(mutex_) = false;  ///< the running job was dropped
  std::stop_source stop_ LM_GUARDED_BY(mutex_);  ///< of the running task
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill
