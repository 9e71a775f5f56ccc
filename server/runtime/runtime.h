// The coordinator with all that it runs on: store, state machine, threads and gate. It knows nothing of how it is
// called.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "server/access/action_log.h"
#include "server/access/gate_options.h"
#include "server/domain/coordinator.h"
#include "server/runtime/farm_loop.h"
#include "server/runtime/gate.h"
#include "server/store/asset_store.h"
#include "server/store/store.h"

namespace lightmill {

struct RuntimeOptions {
  GateOptions gate;
  CoordinatorLimits limits;
  ActionLogLimits log;
  std::vector<std::string> notices;  ///< told to who lists jobs or workers
  /// The store cannot be used any more. From another thread; the coordinator should be stopped.
  std::function<void(const Status&)> on_fatal = [](const Status&) {};
};

/// Servers are given a reference, and end before it.
class Runtime {
 public:
  /// Loads the store, repairs what can be, and starts the threads.
  static Result<std::unique_ptr<Runtime>> start(std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
                                                const RuntimeOptions& options);
  ~Runtime();
  Runtime(const Runtime&) = delete;
  Runtime& operator=(const Runtime&) = delete;

  // Thread-safe.
  Gate& gate() { return gate_; }
  FarmLoop& loop() { return loop_; }
  AssetStore& assets() { return *assets_; }
  const RuntimeOptions& options() const { return options_; }

  /// Callers are served from now on: the farm's log says so.
  void begin();
  /// Forgets assets that no job needs, nor did for a day; none while the farm is too busy to say which. Waits for the
  /// disk.
  void forget_unused_assets();
  /// Commits and ends all threads. An error if something could not be stored.
  Status stop();

 private:
  Runtime(const RuntimeOptions& options, std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
          StoredState& state);

  // In the order of their making; each uses only those above it.
  const RuntimeOptions options_;
  const std::unique_ptr<Store> store_;
  const std::unique_ptr<AssetStore> assets_;
  const std::string start_;            ///< what the log says of it
  const std::vector<JobId> of_pages_;  ///< of the coordinator before
  Gate gate_;
  ActionLog actions_;
  Coordinator farm_;
  FarmLoop loop_;
  bool begun_ = false;
};

}  // namespace lightmill
