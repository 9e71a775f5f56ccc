// Runtime of the coordinator: store, state machine, threads and access control. It does not know gRPC or HTTP.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "server/access/action_log.h"
#include "server/domain/coordinator.h"
#include "server/runtime/access_control.h"
#include "server/runtime/asset_checker.h"
#include "server/runtime/farm_loop.h"
#include "server/store/asset_store.h"
#include "server/store/store.h"

namespace lightmill {

struct RuntimeOptions {
  AccessOptions access;
  CoordinatorLimits limits;
  ActionLogLimits log;
  std::vector<std::string> notices;  ///< shown in lists of jobs and workers
  /// The store is unusable, and the coordinator should be stopped. From another thread.
  std::function<void(const Status&)> on_fatal = [](const Status&) {};
};

/// The user that an asset of this caller counts for (AssetStore::start_upload). Workers send files that they find in
/// users' scene files.
std::string uploader(const Identity& caller);

/// Servers have a reference to it, and end before it.
class Runtime {
 public:
  /// Loads the store, repairs damaged rows, and starts the threads.
  static Result<std::unique_ptr<Runtime>> start(std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
                                                const RuntimeOptions& options);
  ~Runtime();
  Runtime(const Runtime&) = delete;
  Runtime& operator=(const Runtime&) = delete;

  // Thread-safe.
  AccessControl& access() { return access_; }
  FarmLoop& loop() { return loop_; }
  AssetStore& assets() { return *assets_; }
  /// Compares all assets of the jobs that name this damaged one with their digests, in the background.
  void check_assets_of_same_jobs(const Sha256& damaged);
  const RuntimeOptions& options() const { return options_; }

  /// Callers are served from now on. Records the start in the action log.
  void begin();
  /// Deletes assets that no job uses, and that were not used for a day. Deletes none while the farm is too busy to name
  /// the used ones. Blocks on the disk.
  void forget_unused_assets();
  /// Commits and ends all threads. An error if something could not be stored.
  Status stop();

 private:
  Runtime(const RuntimeOptions& options, std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
          StoredState& state);

  // In order of construction. Each uses only those above it.
  const RuntimeOptions options_;
  const std::unique_ptr<Store> store_;
  const std::unique_ptr<AssetStore> assets_;
  AssetChecker asset_checker_;
  const std::string start_;            ///< text of the start in the action log
  const std::vector<JobId> of_pages_;  ///< jobs of pages of the coordinator before
  AccessControl access_;
  ActionLog actions_;
  Coordinator farm_;
  FarmLoop loop_;
  bool begun_ = false;
};

}  // namespace lightmill
