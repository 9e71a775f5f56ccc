// Thread that reads uploaded scene files, so that rendering and heartbeats continue.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <thread>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "common/farm/messages.h"
#include "worker/inspect/reader_process.h"

namespace lightmill {

/// Runs one inspection at a time, in a scene reader. Its thread calls `done` for each one that is not dropped. After one
/// minute, an inspection ends with DEADLINE_EXCEEDED.
class Inspector {
 public:
  using Done = std::function<void(InspectReport)>;
  Inspector(AssetCache& assets, const SceneLimits& limits, const ReaderOptions& reader, AssetUploads uploads, Done done,
            const Clock& clock = system_clock());
  /// Ends a running inspection at once, unless it waits for a transfer.
  ~Inspector();

  /// Replaces an inspection that waits or runs.
  void add(std::shared_ptr<const InspectGrant> grant);
  void drop();

 private:
  void work();
  Result<Inspection> inspect(const InspectGrant& grant, const std::stop_token& stop);

  AssetCache& assets_;
  const SceneLimits limits_;
  const ReaderOptions reader_;
  const AssetUploads uploads_;
  const Done done_;
  const Clock& clock_;
  Mutex mutex_;
  CondVar changed_;
  std::shared_ptr<const InspectGrant> waiting_ LM_GUARDED_BY(mutex_);
  std::stop_source stop_ LM_GUARDED_BY(mutex_);  ///< of the inspection that waits or runs
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill
