// A farm for one command: real coordinator and worker processes on a free loopback port, with a temporary data
// folder.
//
// All its data is deleted with it, so its processes end by SIGKILL. If the client itself is killed, the kernel kills
// them, and the next local farm removes the folder.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/child_process.h"
#include "client/cli/signals.h"
#include "common/base/status.h"

namespace lightmill::cli {

struct LocalFarmOptions {
  unsigned threads = 0;             ///< 0: one per core
  bool unsandboxed_images = false;  ///< as the worker's option
};

class LocalFarm {
 public:
  /// Starts both programs, found beside our own. Waits until the coordinator listens.
  static Result<std::unique_ptr<LocalFarm>> start(Signals& signals, const LocalFarmOptions& options);
  ~LocalFarm();
  LocalFarm(const LocalFarm&) = delete;
  LocalFarm& operator=(const LocalFarm&) = delete;

  const std::string& address() const { return address_; }
  /// An error with the end of its log if one of the processes has ended.
  Status health();

 private:
  LocalFarm() = default;
  Status launch(Signals& signals, const LocalFarmOptions& options);

  std::filesystem::path folder_;
  std::string address_;
  std::optional<ChildProcess> server_, worker_;
};

}  // namespace lightmill::cli
